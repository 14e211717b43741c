# SPDX-License-Identifier: Apache-2.0
"""Every fault of docs/safety/fmea.csv at every operating point, evaluated by what the simulated machine does."""
