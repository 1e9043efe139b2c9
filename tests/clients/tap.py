"""Runs the unittest cases of a Python file and reports them as TAP: python3 tests/clients/tap.py FILE.

Exits with 1 if one failed. Details of failures go to standard error.
"""

import importlib.util
import sys
import unittest


class Tap(unittest.TestResult):
    """Prints a line for each test as it ends."""

    def __init__(self):
        super().__init__()
        self.number = 0

    def line(self, word, test, more=""):
        self.number += 1
        print(f"{word} {self.number} - {test.shortDescription() or test.id()}{more}", flush=True)

    def addSuccess(self, test):
        self.line("ok", test)

    def addFailure(self, test, error):
        super().addFailure(test, error)
        self.line("not ok", test)
        print(self.failures[-1][1], file=sys.stderr)

    def addError(self, test, error):
        super().addError(test, error)
        self.line("not ok", test)
        print(self.errors[-1][1], file=sys.stderr)

    def addSkip(self, test, reason):
        self.line("ok", test, f" # SKIP {reason}")


def main():
    spec = importlib.util.spec_from_file_location("cases", sys.argv[1])
    cases = importlib.util.module_from_spec(spec)
    sys.modules["cases"] = cases  # where unittest looks for setUpModule
    spec.loader.exec_module(cases)
    suite = unittest.defaultTestLoader.loadTestsFromModule(cases)
    result = Tap()
    suite.run(result)
    print(f"1..{result.number}")
    sys.exit(not result.wasSuccessful())


main()
