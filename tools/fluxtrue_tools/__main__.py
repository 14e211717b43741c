# SPDX-License-Identifier: Apache-2.0
"""``python -m fluxtrue_tools``: the command line behind tools/fluxtrue."""

import sys

from fluxtrue_tools.cli import run

sys.exit(run(sys.argv[1:]))
