# SPDX-License-Identifier: Apache-2.0
"""Of all tests: a process that one of them starts can be interrupted.

A shell that starts a job in the background lets it ignore SIGINT, and every process of that job inherits this. A test
that interrupts a command would wait for it until its own time is over, and the command would go on running.
"""

import signal

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
