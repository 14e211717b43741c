# SPDX-License-Identifier: Apache-2.0
"""``python -m fluxtrue_tools``: the command line behind tools/fluxtrue."""

import signal
import sys

from fluxtrue_tools.cli import run


def main() -> None:
    """Run the command of the command line."""
    # As after Ctrl-C: incomplete output files are removed, then the command ends.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    sys.exit(run(sys.argv[1:]))


if __name__ == "__main__":
    main()
