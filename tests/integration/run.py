"""Runs the named test modules. The exit code is 77, which ctest counts as skipped, if all tests
were skipped."""

import sys
import unittest

from processes import SEED


def main():
    print(f"seed: {SEED} (repeat with HYPERMAP_TEST_SEED={SEED})", flush=True)
    suite = unittest.defaultTestLoader.loadTestsFromNames(sys.argv[1:])
    result = unittest.TextTestRunner(verbosity=2).run(suite)
    if not result.wasSuccessful() or result.testsRun == 0:
        return 1
    return 77 if len(result.skipped) == result.testsRun else 0


if __name__ == "__main__":
    sys.exit(main())
