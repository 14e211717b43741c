# SPDX-License-Identifier: Apache-2.0
"""Worst-case execution time of each interrupt handler, from the control-flow graph of the linked image.

flow.py       basic blocks, edges and calls of a function
loops.py      natural loops and their nesting
lines.py      which statement of the C source a loop of the image comes from
facts.py      hal/s32k144/wcet.toml: bounds of loops, lengths of copies, functions that a mode of operation excludes
lengths.py    how many bytes a copy has at most
longest.py    the longest path through one function, by implicit path enumeration
bound.py      handlers: callees first, then the callers with what their callees cost
worst.py      all handlers in all modes of operation
observed.py   what the emulated drive executed: the loops' iterations, the code that ran
places.py     which memory a load or a store goes to
waits.py      the most that an instruction waits for memories, whatever ran before it
"""
