"""``bearcub config``: the configuration in effect, as TOML."""

import argparse
from pathlib import Path

from bearcub.config import Config


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "file", nargs="?", type=Path, metavar="FILE", help="TOML to read; default: the defaults"
    )


def execute(args: argparse.Namespace) -> int:
    """Print the configuration."""
    config = Config() if args.file is None else Config.load(args.file)
    print(config.to_toml(), end="")
    return 0
