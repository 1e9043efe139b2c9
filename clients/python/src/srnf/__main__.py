"""``python3 -m srnf`` is the command ``srnf``."""

import sys

from .cli import main

sys.exit(main())
