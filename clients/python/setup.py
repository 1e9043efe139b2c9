"""The version, from include/srnf/base.h in a clone, and from PKG-INFO in a source distribution."""

import re
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).parent
PLACES = (
    (HERE / ".." / ".." / "include" / "srnf" / "base.h", r'^#define SRNF_VERSION "(.*)"'),
    (HERE / "PKG-INFO", r"^Version: (.*)"),
)
TEXTS = ((place.read_text(), pattern) for place, pattern in PLACES if place.is_file())

setup(version=next(re.search(pattern, text, re.MULTILINE).group(1) for text, pattern in TEXTS))
