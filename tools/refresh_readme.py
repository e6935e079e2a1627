"""Put the real output of bearcub into README.md: ``python tools/refresh_readme.py``.

Replaces what stands between ``<!-- begin bearcub COMMAND -->`` and ``<!-- end -->`` by what that
command prints, and renders the picture anew. Run it on an idle machine: one block is the timing.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PICTURE = "docs/images/sample.jpg"
BLOCK = re.compile(
    r"(?<=<!-- begin bearcub )(.*?)( -->\n```text\n).*?(?=```\n<!-- end -->)", re.DOTALL
)


def bearcub(arguments: str) -> str:
    """Return what ``bearcub ARGUMENTS`` prints."""
    program = [sys.executable, "-c", "from bearcub.cli.main import run; run()"]
    done = subprocess.run(  # noqa: S603 (its own commands)
        [*program, *arguments.split()], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True
    )
    return done.stdout


def main() -> None:
    """Refresh README.md and its picture."""
    readme = ROOT / "README.md"
    text = BLOCK.sub(lambda m: m[1] + m[2] + bearcub(m[1]), readme.read_text(encoding="utf-8"))
    readme.write_text(text, encoding="utf-8")
    bearcub(f"detect --save {PICTURE}")


if __name__ == "__main__":
    main()
