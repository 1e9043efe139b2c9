#!/usr/bin/python3
"""What the tests marked no-asan, and in core/ those marked plain-core, reach that no other test with ASan does.

    tests/reach.py BUILD-FOLDER [FILTER]

BUILD-FOLDER is a build with CONFIG=coverage. Every test that the build with ASan could have (those whose path matches
FILTER, an extended regular expression) runs alone, its counts in a folder of its own. A counter is one of those that
gcc puts at branches: what each test reaches is the set of counters above 0 in core/ and server/. Prints for each
test its counters and how many of them no other test reaches, and last how many of all counters only
what runs without ASan reaches. A daemon that a test kills takes its counts with it. Takes about twenty minutes of processor time.
"""
import collections
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

FUNCTION = 0x01000000
ARCS = 0x01A10000


def counters(data):
    """The counters above 0 of a file of counts, as (function, index): see gcc's gcov-io.h."""
    reached, function, at = set(), None, 16
    while at + 8 <= len(data):
        tag, size = struct.unpack_from("<Ii", data, at)
        at += 8
        if tag == FUNCTION and size >= 12:
            function = struct.unpack_from("<I", data, at)[0]
        if tag == ARCS and size > 0:
            counts = struct.unpack_from(f"<{size // 8}Q", data, at)
            reached.update((function, i) for i, count in enumerate(counts) if count)
        at += max(size, 0)  # all counts are 0 where the size is negative
    return reached


def markers(test):
    head = test.read_text(errors="replace").splitlines()[:20]
    return {match[1] for line in head if (match := re.search(r"srnfd-test: ([a-z-]+)", line))}


def reach(build, test):
    """What a test reaches in core/ and server/, and how it ended."""
    with tempfile.TemporaryDirectory() as folder:
        ended = subprocess.run(
            ["tests/run.sh", build, "^" + re.escape(str(test.relative_to("tests"))) + "$"],
            env={**os.environ, "GCOV_PREFIX": folder}, stdout=subprocess.PIPE, text=True, check=False)
        found = set()
        for path in pathlib.Path(folder).rglob("*.gcda"):
            name = str(path).partition("/obj/")[2]
            if name.startswith(("core/", "server/")):
                found.update((name, *counter) for counter in counters(path.read_bytes()))
        return found, ended.stdout.splitlines()[-1]


def main():
    build, wanted = sys.argv[1], re.compile(sys.argv[2] if len(sys.argv) > 2 else "")
    os.chdir(pathlib.Path(__file__).parent.parent)
    tests = sorted(path for pattern in ("test_*.c", "test_*.sh") for path in pathlib.Path("tests").rglob(pattern))
    marked = {test: markers(test) for test in tests if wanted.search(str(test.relative_to("tests")))}
    reached = {}
    for test, marks in marked.items():
        if not marks & {"release-only", "nightly", "alone"}:
            reached[test], end = reach(build, test)
            print(f"{test}: {end}", file=sys.stderr)
    times = collections.Counter(counter for found in reached.values() for counter in found)
    for test, found in reached.items():
        own = sum(times[counter] == 1 for counter in found)
        mark = " ".join(marked[test] & {"no-asan", "plain-core"})
        print(f"{len(found):7d} {own:5d}  {mark:10s}  {test}")
    kept = {counter for test, found in reached.items() if "no-asan" not in marked[test] for counter in found
            if "plain-core" not in marked[test] or not counter[0].startswith("core/")}
    print(f"{len(times)} counters reached, {len(times.keys() - kept)} only without ASan")


main()
