"""Do the bands of tensile tests hold EA at each tension?

``python -m tests.campaigns.bands [--tests 400]`` fits so many simulated tests of each wire and
noise, and prints how often the 95 % band holds EA at each tension. 400 tests scatter by 1.1 %.
"""

import argparse

from cdsm.support.progress import track
from tests.wires.test_tensile import PLACES, RIGIDITIES, covered


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tests", type=int, default=400)
    count = parser.parse_args().tests
    print(f"{'% held at [N]':<16}" + "".join(f"{place:>6g}" for place in PLACES))
    for law, noise in track([(law, noise) for law in RIGIDITIES for noise in (0.5, 2.0)], "wires"):
        shares = 100.0 * covered(law, noise, range(count)).mean(axis=0)
        print(f"{law:<8}{noise:>5g} N  " + "".join(f"{share:>6.1f}" for share in shares))


if __name__ == "__main__":
    main()
