"""Following a floor outwards, bin by bin, by the residuals of its pixels against a plane."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence

IQR = 0.7413  # 1-sigma over the interquartile range of a normal distribution
LEAST = 12  # pixels of a bin
SHARE = 0.25  # of a bin's pixels that must lie on the profile
STEP = 0.01  # change of height between neighbouring bins that is no step [m]
CORRELATED = 12.0  # neighbouring pixels of a matcher that err together
DEEP = 7.0  # times the noise below the floor, where noise does not reach
AGAIN = 3  # bins on one level beyond a step up that are ground again
HIGHEST_STEP = 0.5  # of the camera's height
MIXED = 2.5  # spread of several surfaces, over the noise of one
SMALLEST = 0.1  # least noise believed [px]
ROUNDING = 1e-5  # of floats: what lies on the profile itself is not below it [px]
LARGEST = 1.5  # largest spread of a surface that is followed [px]
NOISIEST = 0.75  # largest noise of the floor believed [px]: what errs farther is mismatched


class Tracker:
    """Where the profile is while it is followed outwards.

    Residuals are lists in ascending order.
    """

    def __init__(self, *, height: float, depth: float, steepest: float, noise: float) -> None:
        self._height = height
        self._depth = depth
        self._steepest = steepest
        self._noise = noise
        self._tail = noise
        self._lift = self._grade = 0.0  # height of the profile above the plane [m]; bend by level
        self._x: float | None = None
        self.ended = False
        self._upper: list[tuple[float, float]] = []  # height and range of ground beyond a step up
        self._foot = self._excess = 0.0  # height where it began to climb too steeply; so far [m]
        self._bins_up = 0  # since there
        self.refused = 0  # bins that turned out to be of a bank, the last one included
        self.share = 1.0  # of the last bin's pixels that lay on the profile
        self.regained = 0  # bins that turned out to be ground beyond a step, the last one included

    def advance(self, level: float, way: Sequence[float], lying: Sequence[float]) -> float:
        """Move on to the next bin and return the floor's disparity there less the plane's [px].

        `lying` are the residuals of the `way` whose pixels lie as ground does.
        """
        if self.ended:
            self._look_beyond(level, way)
            return self.bend_at(level)
        self._bins_up += 1
        expected = self.bend_at(level)
        x = self._depth / (level + expected)
        run = 0.0 if self._x is None else max(0.0, x - self._x)
        rise = self._steepest * run
        reach = 3.0 * self._noise
        least = max(LEAST // 2, SHARE * len(way))
        # what goes on as before is the floor, however much stands beside it
        first, last = _between(way, expected - reach, expected + reach)
        if last - first < least:
            low = level * self._grade_of(self._lift - rise) - reach
            high = level * self._grade_of(self._lift + rise) + reach
            first, last = _between(way, low, high)
            if last - first < least:
                # a step takes most of the way off the floor, to one side
                most = (1 - SHARE) * len(way)
                self.ended = (
                    bisect_left(way, high) < len(way) - most or bisect_right(way, low) > most
                )
                self.share = max(0.1, (last - first) / len(way))
                return expected
        # what stands there is no ground, and where nothing lies nothing tells how it goes on
        first, last = bisect_left(lying, way[first]), bisect_right(lying, way[last - 1])
        if last - first < LEAST // 2:
            self.share = max(0.1, (last - first) / len(way))
            return expected
        for _ in range(2):  # to the middle of that surface
            middle = lying[(first + last) // 2]
            first, last = _between(lying, middle - reach, middle + reach)
        count = last - first
        self.share = max(0.1, count / len(way))
        lift, there = self._place(level, lying[(first + last) // 2])
        self._settle(level, lift, there, _spread(lying, first, last), count, rise)
        return self.bend_at(level)

    def _settle(
        self, level: float, lift: float, there: float, spread: float, count: int, rise: float
    ) -> None:
        """Take a bin's surface for the floor, unless it is a step away or a bank.

        It lies `lift` above the plane, `there` ahead [m]; `count` pixels tell, with a `spread`
        [px]; ground may `rise` so far over the bin [m].
        """
        # a spread far beyond the noise so far is of several surfaces, and excuses no climb
        noise = min(spread, 1.5 * self._noise)
        doubt = self._height * noise / level * math.sqrt(CORRELATED / count)
        change = lift - self._lift
        if self._x is not None:
            climb = self._steepest * max(0.0, there - self._x)
            # the same noise is of less height, and of less way, where ground is nearer
            flat = there * level / self._depth
            along = self._steepest * self._depth / (self._height * level)
            most = climb + 2 * doubt * min(1.0, (1 + along) * flat**2) + STEP
            if change < -most:
                self.ended = True
                return
            if self._excess + change > most:
                self._back_to_the_foot()
                return
            # what a few far pixels say is weighed against how much ground changes over the bin
            # ... where it falls, by how much height the noise is as far away as that
            doubt *= max(1.0, flat) ** 2
            change *= 1 / (1 + (doubt / (0.5 * (rise + STEP))) ** 2)
            self._excess += change - climb
        if self._excess <= 0:
            self._excess, self._foot, self._bins_up = 0.0, self._lift + change, 0
        self._noise = 0.7 * self._noise + 0.3 * min(max(spread, SMALLEST), LARGEST)
        self._rise(change)
        self._x = there if self._x is None else max(self._x, there)

    def _back_to_the_foot(self) -> None:
        """End the floor where it began to climb more than it may, summed over the bins since.

        As Page's test has it [1]_: in one bin a bank of 45 deg rises by no more than noise does.

        References
        ----------
        .. [1] E. S. Page: "Continuous inspection schemes", Biometrika 41, 1954.
        """
        self.ended, self.refused = True, self._bins_up
        self._rise(self._foot - self._lift)

    def _look_beyond(self, level: float, way: Sequence[float]) -> None:
        """Go on where the way lies on one level again beyond a step up: stairs, a pavement."""
        lift, there = self._place(level, way[len(way) // 2])
        last_lift, last_there = self._upper[-1] if self._upper else (lift, 0.0)
        doubt = 2 * self._height * self._noise / level * math.sqrt(CORRELATED / len(way))
        above = self._lift + STEP < lift < HIGHEST_STEP * self._height
        if not above or _spread(way, 0, len(way)) > MIXED * self._noise:
            self._upper = []
        elif abs(lift - last_lift) <= doubt + STEP and there > last_there:
            self._upper.append((lift, there))
        else:
            self._upper = [(lift, there)]
        if len(self._upper) >= AGAIN:
            self.regained = len(self._upper)
            self._rise(sum(lift for lift, _ in self._upper) / self.regained - self._lift)
            self._x, self._upper, self.ended = there, [], False

    def _place(self, level: float, bend: float) -> tuple[float, float]:
        """Return the height above the plane and the range [m] of ground with this bend."""
        disparity = max(level + bend, 0.1)
        return self._height * bend / disparity, self._depth / disparity

    def bend_at(self, level: float) -> float:
        """Return the floor's disparity less the plane's [px]."""
        return level * self._grade

    def _rise(self, change: float) -> None:
        self._lift += change
        self._grade = self._grade_of(self._lift)

    def _grade_of(self, lift: float) -> float:
        """Return the extra disparity of ground that lies `lift` above the plane, over the level."""
        return lift / max(self._height - lift, 0.05 * self._height)

    def spread(self, here: Sequence[float], bend: float) -> float:
        """Return the noise told by the pixels below the floor [px]; the last one when few do."""
        if self.ended:  # what lies below is another floor, not noise
            return self._tail
        # what lies many times the noise lower is a hole
        lowest = bend - min(max(DEEP * self._noise, 1.0), 3 * LARGEST)
        first, last = bisect_right(here, lowest), bisect_left(here, bend - ROUNDING)
        if last - first >= max(LEAST // 2, 0.1 * len(here)):
            # matchers' errors have heavy tails
            tail = (bend - here[first + int(0.05 * (last - first - 1) + 0.5)]) / 1.96
            self._tail = min(max(tail, SMALLEST), NOISIEST)
        return self._tail


def _between(values: Sequence[float], low: float, high: float) -> tuple[int, int]:
    """Return the first, and beyond the last, of the values in ascending order between two."""
    return bisect_right(values, low), bisect_left(values, high)


def _spread(values: Sequence[float], first: int, last: int) -> float:
    """Return a robust 1-sigma of some of the values in ascending order."""
    count = last - first
    return IQR * (values[first + 3 * count // 4] - values[first + count // 4])
