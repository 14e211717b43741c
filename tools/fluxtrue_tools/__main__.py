# SPDX-License-Identifier: Apache-2.0
"""``python -m fluxtrue_tools``: the command line behind tools/fluxtrue."""

import sys

from fluxtrue_tools import interrupts
from fluxtrue_tools.cli import run


def main() -> None:
    """Run the command of the command line."""
    interrupts.install()
    sys.exit(run(sys.argv[1:]))


if __name__ == "__main__":
    main()
