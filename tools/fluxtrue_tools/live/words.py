# SPDX-License-Identifier: Apache-2.0
"""The words that the page shows for numbers of the bus: name and explanation as the DBC has them, and what to do.

The DBC takes names and explanations from the firmware's lists (fluxtrue_tools.bus.words). The advice to the user of the
page is written here, under the names of the DBC; a test compares the two.
"""

from typing import Final

from fluxtrue_tools import faults

STATE: Final = "INV_Status.State"
REFUSED: Final = "INV_DcLink.RefusedReason"
DERATING: Final = "INV_DcLink.DeratingReason"
LIMIT: Final = "INV_Limits.RequestLimit"
DRIVE_FAULTS: Final = "INV_Faults.DriveFaults"
ECU_FAULTS: Final = "INV_Faults.EcuFaults"
MOTOR_CHECK: Final = "INV_Configuration.MotorCheck"

REBUILD: Final = "Correct the motor data, build the firmware again and program it."
WIRING: Final = "Check the sensor, its supply and its wiring."
REPAIR: Final = "Do not drive. Check the shut-off paths of the board."

TO_DO: Final[dict[str, dict[str, str]]] = {
    STATE: {
        "init": "Wait for the self-test.",
        "standby": "Press Ready to charge the dc link.",
        "precharge": "Wait until the dc link is charged.",
        "ready": "Press Enable to enable the switching at zero torque.",
        "run": "Set the torque with the slider or as a number.",
        "derate": "Remove the cause, or request less torque.",
        "safe_state": "Let the machine slow down. The reset is accepted in state fault.",
        "fault": "Read the faults, remove their cause, then press Reset.",
        "discharge": "Wait until the dc link is discharged.",
    },
    REFUSED: {
        "none": "",
        "torque_request_not_zero": "Request zero torque, then press Enable.",
        "fault": "Remove the cause of the fault and press Reset, then Enable.",
        "dc_voltage_out_of_range": "Bring the dc voltage into its range, then press Enable.",
        "sensor_implausible": "Check the current sensors: without switching they must read zero.",
        "not_ready": "Press Ready, wait for state ready, then press Enable.",
        "mode_locked": "Press Ready: this page drives in mode torque only.",
        "command_timed_out": "Check the bus and the load of this computer, then press Enable.",
        "reset_while_enabled": "Press Stop and wait for state fault, then press Reset.",
        "angle_not_absolute": "Turn the shaft until the encoder's index has passed, then press Enable.",
        "movement_ended": "A tool turns the shaft for commissioning: let it end the movement, then press Enable.",
    },
    DERATING: {
        "none": "",
        "inverter_temperature": "Let the inverter cool down, or improve its cooling.",
        "winding_temperature": "Let the winding cool down, or improve its cooling.",
        "dc_voltage": "Bring the dc voltage away from its limit.",
        "battery_power": "Request less torque or drive slower: power is torque times speed.",
        "magnet": "Request less torque or drive slower, so that less i_d is needed.",
        "temperature_sensor": WIRING,
        "battery_limits_lost": "Let the battery's limits be sent again, every 100 ms.",
        "speed": "Drive slower.",
    },
    LIMIT: {
        "none": "",
        "rated_torque": "Request no more than the machine's rated torque.",
        "vehicle_limit": "Raise the torque limit in the command.",
        "reach": "Drive slower, raise the dc voltage, or request less torque.",
    },
    DRIVE_FAULTS: {
        "over_current": "Check the phases for a short circuit, then motor data and current control.",
        "over_voltage": "Brake with less power, or check the connection to the battery.",
        "under_voltage": "Check the dc supply, its contactor and its cables.",
        "current_sum": "Check the insulation of the phases and the gains of the current sensors.",
        "angle": WIRING,
        "input": "Check the converters, their trigger, reference and supply, and the zero of the current sensors.",
        "overrun": "Reset once. If it comes again, the processor has too much to do.",
        "config": REBUILD,
        "control": "Check the phases and whether the motor data belong to this machine.",
        "phase_lost": "Check the phase's cable and its half bridge.",
        "current_stuck": WIRING,
        "over_speed": "Keep the load from driving the machine beyond its largest speed.",
        "angle_offset": "Measure the angle offset again; check the sensor's coupling to the shaft.",
        "torque": "Check current sensors, angle and motor data before the next drive.",
        "temperature": "Let inverter and winding cool down.",
        "gate": "Check the gate driver, its supply and the half bridges.",
    },
    ECU_FAULTS: {
        "ecu_protection": "Check the bus, and that no other node sends torque commands.",
        "ecu_precharge": "Check the dc supply and the precharge resistor.",
        "ecu_discharge": "The dc link may still be charged: check the discharge resistor.",
        "ecu_gate": "Check the gate driver and its supply.",
        "ecu_task": "Reset once. If it comes again, the processor has too much to do.",
        "ecu_stall": "Reset once. If it comes again, check the converters' trigger.",
        "ecu_self_test": "Switch the supply off and on. If it comes again, check the board.",
        "ecu_battery_voltage": "Check contactor, cables and the battery's voltage on the bus.",
        "ecu_gate_disable": REPAIR,
        "ecu_gate_supply": REPAIR,
        "ecu_watchdog": REPAIR,
    },
}
"""What to do, for each name of a signal."""

Words = dict[str, dict[int, tuple[str, str, str]]]


def words() -> Words:
    """Name, explanation and what to do, by signal and value or bit."""
    found: Words = {}
    for path, advice in TO_DO.items():
        found[path] = {value: (name.replace("_", " "), text, advice[name])
                       for value, (name, text) in faults.explained(path).items()}  # fmt: skip
    found[MOTOR_CHECK] = {value: (name.replace("_", " "), text, REBUILD if value else "")
                          for value, (name, text) in faults.explained(MOTOR_CHECK).items()}  # fmt: skip
    return found
