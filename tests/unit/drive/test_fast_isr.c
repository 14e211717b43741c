/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/measure.h"
#include "drive/mrai/mrai_seam.h"
#include "drive/short_circuit.h"
#include "drive/slow_monitors.h"
#include "drive/turning_modulate.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

void setUp(void)
{
    seam_start();
}

void tearDown(void)
{
}

static const sample_t *published(void)
{
    return &drive.samples.slot[drive.samples.generation % SAMPLE_SLOTS];
}

void test_a_period_samples_then_switches_then_pends_the_papers_identification_once(void)
{
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    seam_run();
    seam_period();
    TEST_ASSERT_EQUAL_STRING("arw+p", seam.log);
    seam_period();
    TEST_ASSERT_EQUAL_STRING("arw+p", seam.log);
}

void test_the_robust_identification_needs_no_interrupt_of_its_own(void)
{
    seam_run();
    seam_periods(20);
    TEST_ASSERT_EQUAL_STRING("arw", seam.log); /* switching has long been enabled */
    TEST_ASSERT_EQUAL_INT(0, seam.pended);
    TEST_ASSERT_EQUAL_UINT32(0, mrai_overruns(&drive));
}

/* The expected sums are those of ten published samples of current and acting voltage. */
void test_ten_periods_make_a_window_of_sums(void)
{
    seam_current(100.0, -50.0, -50.0);
    seam_run();
    seam_periods(10); /* no voltage acts in the first two of them */
    TEST_ASSERT_EQUAL_UINT32(1, drive.windows.generation);
    TEST_ASSERT_FALSE(window_box_at(&drive.windows)->acting);
    dq_q15_t sum_i = {0, 0}, sum_u = {0, 0};
    for (int n = 0; n < 10; n++) {
        TEST_ASSERT_EQUAL_UINT32(1, drive.windows.generation);
        seam_period();
        sum_i = (dq_q15_t){sum_i.d + published()->point.i.d, sum_i.q + published()->point.i.q};
        sum_u = (dq_q15_t){sum_u.d + published()->point.u.d, sum_u.q + published()->point.u.q};
    }
    TEST_ASSERT_EQUAL_UINT32(2, drive.windows.generation);
    const identify_window_t window = *window_box_at(&drive.windows);
    TEST_ASSERT_INT_WITHIN(200, 81920, window.sum_i.d); /* 100 of 400 A, ten times */
    TEST_ASSERT_EQUAL_INT(sum_i.d, window.sum_i.d);
    TEST_ASSERT_EQUAL_INT(sum_i.q, window.sum_i.q);
    TEST_ASSERT_EQUAL_INT(sum_u.d, window.sum_u.d);
    TEST_ASSERT_EQUAL_INT(sum_u.q, window.sum_u.q);
    TEST_ASSERT_EQUAL_UINT32(published()->theta_e, window.last.theta);
    TEST_ASSERT_TRUE(window.acting);
}

void test_the_flux_of_the_robust_identification_is_fed_forward_from_the_next_period_on(void)
{
    drive.task.psi_d_error = -1234;
    seam_period();
    TEST_ASSERT_EQUAL_INT(-1234, drive.psi_d_error);
}

static void expect_bridge(bool gates, int duty)
{
    TEST_ASSERT_EQUAL(gates, seam.gates);
    TEST_ASSERT_EQUAL_INT(duty, seam.duty.a);
    TEST_ASSERT_EQUAL_INT(duty, seam.duty.b);
    TEST_ASSERT_EQUAL_INT(duty, seam.duty.c);
}

/* Either shorted by the lower switches, or switching disabled. */
static void expect_shorted(bool is)
{
    expect_bridge(is, is ? 0 : 16384);
}

static void expect_shorted_by_the_upper_switches(void)
{
    expect_bridge(true, 32768);
}

/* Switching is disabled before anything else is written. */
void test_while_the_drive_is_off_switching_is_disabled_first_and_the_duties_are_one_half(void)
{
    seam_period();
    TEST_ASSERT_EQUAL_STRING("ar-w", seam.log);
    expect_shorted(false);
}

void test_an_over_current_disables_switching_in_the_same_period_and_stays_latched(void)
{
    seam_run();
    seam_periods(3);
    TEST_ASSERT_TRUE(seam.gates);
    seam_current(310.0, -155.0, -155.0);
    seam_period();
    TEST_ASSERT_EQUAL_STRING("ar-w", seam.log);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, drive.fast.faults);
    seam_current(0.0, 0.0, 0.0);
    seam_periods(100);
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT, drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(RUN_STATE_FAULT, drive.task.run_state);
}

static void write_command(safe_t safe, uint32_t faults)
{
    command_t command = *command_box_read(&drive.commands);
    command.safe = safe;
    command.run = command.run && faults == 0U;
    command.faults = faults;
    command_box_write(&drive.commands, command);
}

/* Switching is disabled in the period of the fault, and for half a step; then the duties of the short circuit are
 * written before switching is enabled. */
void test_a_fault_shorts_the_phases_half_a_step_later_if_the_task_has_decided_so(void)
{
    seam_run();
    seam_periods(3);
    write_command(SAFE_SHORT_CIRCUIT, 0);
    seam_current(310.0, -155.0, -155.0);
    for (uint32_t k = 0; k < motor.bases.periods_per_step / 2U; k++) {
        write_command(SAFE_SHORT_CIRCUIT, 0);
        seam_period();
        expect_shorted(false);
        TEST_ASSERT_FALSE(seam.gates);
    }
    write_command(SAFE_SHORT_CIRCUIT, 0);
    seam_period();
    TEST_ASSERT_EQUAL_STRING("arw+", seam.log);
    expect_shorted(true);
}

/* An over-voltage cannot wait, and over-temperature and over-speed have moved the currents. Nothing
 * waits a second time, and nothing without a bridge that has run. */
void test_only_a_fault_that_leaves_unknown_currents_waits_and_only_once(void)
{
    static const struct {
        uint32_t faults;
        bool waits;
    } expected[] = {
        {FAULT_OVER_CURRENT, true},
        {FAULT_OVER_CURRENT | FAULT_TEMPERATURE, true},
        {FAULT_OVER_CURRENT | FAULT_OVER_VOLTAGE, false},
        {FAULT_TORQUE | FAULT_GATE, true},
        {FAULT_GATE | FAULT_OVER_VOLTAGE, false},
        {FAULT_TEMPERATURE | FAULT_OVER_SPEED, false},
        {0, false},
    };
    for (unsigned n = 0; n < sizeof expected / sizeof expected[0]; n++) {
        fast_state_t fast = {.faults = expected[n].faults};
        TEST_ASSERT_FALSE(short_circuit_waits(&fast));
        short_circuit_prepare(&fast, 2);
        TEST_ASSERT_EQUAL(expected[n].waits, short_circuit_waits(&fast));
        TEST_ASSERT_EQUAL(expected[n].waits, short_circuit_waits(&fast));
        const bool is_searched = expected[n].waits && (expected[n].faults & FAULT_GATE) != 0U;
        TEST_ASSERT_EQUAL(is_searched, short_circuit_waits(&fast)); /* until the search for a shorted switch ends it */
    }
    fast_state_t later = {.faults = FAULT_OVER_CURRENT};
    short_circuit_prepare(&later, 2);
    TEST_ASSERT_TRUE(short_circuit_waits(&later));
    later.faults |= FAULT_OVER_VOLTAGE;
    TEST_ASSERT_FALSE(short_circuit_waits(&later));
}

/* The currents have been moved, and the short circuit is on: the second fault must not interrupt it. */
void test_a_second_fault_that_would_wait_does_not_interrupt_the_short_circuit(void)
{
    fast_state_t fast = {.faults = FAULT_OVER_SPEED};
    short_circuit_prepare(&fast, 2);
    TEST_ASSERT_FALSE(short_circuit_waits(&fast));
    fast.faults |= FAULT_OVER_CURRENT;
    TEST_ASSERT_FALSE(short_circuit_waits(&fast));
}

/* Else the gates that were off before it begins would look like a side that the drivers have ended. */
void test_while_the_bridge_runs_no_short_circuit_is_on(void)
{
    fast_state_t fast = {.short_circuit = {.holds = true, .changes = 2}};
    short_circuit_prepare(&fast, 5);
    TEST_ASSERT_FALSE(fast.short_circuit.holds);
    TEST_ASSERT_EQUAL_UINT8(0, fast.short_circuit.changes);
    TEST_ASSERT_EQUAL_UINT8(5, fast.short_circuit.waits);
}

static void want_upper_switches(bool upper)
{
    command_t command = *command_box_read(&drive.commands);
    command.upper = upper;
    command_box_write(&drive.commands, command);
}

/* The task has found a constant current. What the gate drivers end counts for more. */
void test_the_task_may_request_the_short_circuit_by_the_upper_switches(void)
{
    seam_run();
    seam_periods(3);
    write_command(SAFE_SHORT_CIRCUIT, FAULT_TEMPERATURE);
    seam_period();
    expect_shorted(true);
    want_upper_switches(true);
    seam_period();
    expect_shorted_by_the_upper_switches();
    TEST_ASSERT_TRUE(drive_is_shorted(&drive));
    want_upper_switches(false);
    seam_period();
    expect_shorted(true);
    want_upper_switches(true);
    seam_period();
    expect_shorted_by_the_upper_switches();
    seam.gates_blocked = true;
    seam_period();
    expect_shorted(true);
    seam.gates_blocked = false;
    seam_period();
    expect_shorted(true);
    seam.gates_blocked = true;
    seam_period();
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_EQUAL_INT(16384, seam.duty.a);
}

/* As fast_isr() gives it to the short circuit. */
static safe_period_t safe_period(const sample_t *sample, fx_pair_t rotation, int32_t angle_step)
{
    return (safe_period_t){sample, measure_phases(sample->i_ab, sample->zero_q28), rotation, angle_step};
}

/* One period of a short circuit in which phase a only conducts in this direction; a turn has twenty. */
static void short_one_sided(int32_t i_a)
{
    const sample_t sample = {.i_ab = fx_pair(i_a, 0), .point.i = {i_a, 0}};
    seam.log[0] = '\0';
    const safe_period_t now = safe_period(&sample, fx_pair(Q15(0.999), 0), INT32_MAX / 10);
    short_circuit_step(&drive, &now, false);
}

/* Current out of the bridge by the lower switches, then into it by the upper ones, which ends the wait for a reset. */
void test_a_switch_that_stays_off_changes_the_side_of_the_short_circuit_until_the_bridge_runs_again(void)
{
    for (int n = 0; n <= 20; n++) { /* what is on is examined from the second period on */
        short_one_sided(5000);
        expect_shorted(true);
    }
    short_one_sided(5000);
    expect_shorted_by_the_upper_switches();
    for (int n = 0; n < 21; n++) {
        short_one_sided(-5000 * ((n & 1) ? 1 : -1));
        expect_shorted_by_the_upper_switches();
    }
    short_circuit_end(&drive.fast);
    short_one_sided(0);
    expect_shorted_by_the_upper_switches();
    short_circuit_prepare(&drive.fast, 0);
    short_one_sided(0);
    expect_shorted(true);
}

static int32_t psi_f(void)
{
    return seam.motor.safe_state.psi_f;
}

/* One period of a short circuit with a small current of changing sign. Its field turns by a twentieth of a turn. */
static void short_with(const flux_point_t *flux, fx_pair_t rotation, dq_q15_t i, int32_t zero_q28)
{
    static int32_t sign = 1;
    sign = -sign;
    const sample_t sample = {.i_ab = fx_pair(100 * sign, 0), .zero_q28 = zero_q28, .point = {.i = i, .flux = *flux}};
    seam.log[0] = '\0';
    const safe_period_t now = safe_period(&sample, rotation, INT32_MAX / 10);
    short_circuit_step(&drive, &now, false);
}

/* The same with this flux in the direction of phase a. */
static void short_with_flux(int32_t psi_a, int32_t zero_q28)
{
    const flux_point_t flux = {.psi_d = psi_a};
    short_with(&flux, fx_pair(32767, 0), (dq_q15_t){100, 0}, zero_q28);
}

static void shorted_with_flux(int periods, int32_t psi_a, void (*expect)(void))
{
    for (int n = 0; n < periods; n++) {
        short_with_flux(psi_a, 0);
        expect();
    }
}

static void expect_shorted_by_the_lower_switches(void)
{
    expect_shorted(true);
}

/* The flux is searched in the second period, the first in which the short circuit has been on, and in every second one
 * from there. A third change is one too many. */
void test_flux_that_a_complete_short_circuit_would_keep_changes_the_side_twice_at_most(void)
{
    shorted_with_flux(2, 0, expect_shorted_by_the_lower_switches);
    shorted_with_flux(1, psi_f(), expect_shorted_by_the_lower_switches);
    shorted_with_flux(1, psi_f(), expect_shorted_by_the_upper_switches);
    shorted_with_flux(3, psi_f(), expect_shorted_by_the_upper_switches);
    drive.psi_d_error = (q15_t)-psi_f(); /* it belongs to the flux */
    shorted_with_flux(1, psi_f(), expect_shorted_by_the_lower_switches);
    shorted_with_flux(4, psi_f(), expect_shorted_by_the_lower_switches);
    drive.psi_d_error = 0;
    shorted_with_flux(8, psi_f(), expect_shorted_by_the_lower_switches);
}

void test_half_of_the_magnets_flux_is_the_bound(void)
{
    shorted_with_flux(3, 0, expect_shorted_by_the_lower_switches);
    shorted_with_flux(8, psi_f() * 48 / 100, expect_shorted_by_the_lower_switches);
    shorted_with_flux(2, psi_f() * 52 / 100, expect_shorted_by_the_upper_switches);
}

/* A turn has ten searches: 0.055 of the magnet's flux each are found in the tenth, 0.04 never. */
void test_the_flux_of_a_turn_counts(void)
{
    for (int n = 0; n < 60; n++) {
        short_with_flux(psi_f() * 40 / 1000 * (n / 2) - 20000, 0);
        expect_shorted(true);
    }
    seam_start();
    int n = 0;
    for (; n < 60 && drive.fast.short_circuit.side == SHORT_CIRCUIT_LOWER; n++) {
        short_with_flux(psi_f() * 55 / 1000 * (n / 2) - 20000, 0);
    }
    TEST_ASSERT_INT_WITHIN(3, 22, n);
}

/* In the stator's frame: psi_q of a rotor at 90 degrees, and psi_d of one at 120 degrees, the direction of phase b. */
void test_the_flux_is_that_of_the_stators_frame(void)
{
    const flux_point_t none = {0}, q = {.psi_q = -psi_f()}, d = {.psi_d = psi_f()};
    const fx_pair_t quarter = fx_pair(0, 32767), third = fx_pair(Q15(-0.5), Q15(SQRT3_HALF));
    for (int k = 0; k < 2; k++) {
        seam_start();
        for (int n = 0; n < 4; n++) {
            short_with((n < 3) ? &none : (k == 0) ? &q : &d, (k == 0) ? quarter : third, (dq_q15_t){100, 0}, 0);
        }
        expect_shorted_by_the_upper_switches();
    }
}

/* The tables end at the largest current. 16 periods: after a turn the currents would be one-sided. */
void test_flux_beyond_the_tables_changes_no_side(void)
{
    const int32_t i_max = seam.motor.current_reference.i_max;
    const flux_point_t none = {0}, much = {.psi_d = psi_f()};
    for (int n = 0; n < 16; n++) {
        short_with((n % 8 < 4) ? &none : &much, fx_pair(32767, 0), (dq_q15_t){1, i_max}, 0);
        expect_shorted(true);
    }
}

/* With a gate fault, or before the short circuit is on, what was seen of another one does not count. */
void test_where_no_open_switch_is_searched_the_search_begins_anew(void)
{
    const open_switch_state_t seen = {.has_begun = true, .turned_q16 = 9000, .one_sided_q16 = {7, 8, 9}};
    const sample_t sample = {.v_dc = 12000};
    for (int k = 0; k < 2; k++) {
        seam_start();
        drive.fast.faults = (k == 0) ? FAULT_GATE : FAULT_ANGLE;
        drive.fast.short_circuit.holds = k == 0;
        seam.gates = true;
        drive.fast.short_circuit.open_switch = seen;
        const safe_period_t now = safe_period(&sample, fx_pair(32767, 0), 0);
        short_circuit_step(&drive, &now, false);
        const open_switch_state_t *state = &drive.fast.short_circuit.open_switch;
        TEST_ASSERT_FALSE(state->has_begun);
        TEST_ASSERT_EQUAL_INT(0, state->one_sided_q16[0] + state->one_sided_q16[1] + state->one_sided_q16[2]);
    }
}

void test_a_side_that_has_been_found_is_kept_when_the_faults_are_reset(void)
{
    const int32_t psi = psi_f();
    shorted_with_flux(3, 0, expect_shorted_by_the_lower_switches);
    shorted_with_flux(1, psi, expect_shorted_by_the_upper_switches);
    short_circuit_reset(&drive.fast);
    shorted_with_flux(3, psi, expect_shorted_by_the_upper_switches);
}

void test_a_reset_permits_both_sides_where_the_gate_drivers_have_ended_the_one_that_was_found(void)
{
    const int32_t psi = psi_f();
    shorted_with_flux(3, 0, expect_shorted_by_the_lower_switches);
    shorted_with_flux(1, psi, expect_shorted_by_the_upper_switches);
    seam.gates_blocked = true;
    short_with_flux(psi, 0);
    TEST_ASSERT_EQUAL(SHORT_CIRCUIT_LAST_LOWER, drive.fast.short_circuit.side);
    seam.gates_blocked = false;
    short_circuit_reset(&drive.fast);
    TEST_ASSERT_EQUAL(SHORT_CIRCUIT_LOWER, drive.fast.short_circuit.side);
    TEST_ASSERT_EQUAL(0, drive.fast.short_circuit.changes);
}

void test_a_reset_clears_a_side_that_the_task_has_chosen(void)
{
    drive.fast.short_circuit.side = SHORT_CIRCUIT_UPPER;
    short_circuit_reset(&drive.fast);
    TEST_ASSERT_EQUAL(SHORT_CIRCUIT_LOWER, drive.fast.short_circuit.side);
}

/* The sum of the currents shows that a sensor is wrong or saturated. */
void test_currents_that_are_not_plausible_change_no_side(void)
{
    const int32_t most = seam.motor.monitor.zero_sequence_max * 8192;
    for (int n = 0; n < 60; n++) {
        short_with_flux((n % 8 < 4) ? 0 : psi_f(), most + 8192);
        expect_shorted(true);
    }
    for (int n = 0; n < 4; n++) {
        short_with_flux((n < 3) ? 0 : psi_f(), most);
    }
    expect_shorted_by_the_upper_switches();
}

/* By the upper switches the diodes conduct into the bridge. */
void test_the_side_changes_back_where_the_other_one_lacks_a_switch(void)
{
    for (int n = 0; n <= 21; n++) {
        short_one_sided(5000);
    }
    expect_shorted_by_the_upper_switches();
    for (int n = 0; n <= 20; n++) {
        short_one_sided(-5000);
    }
    expect_shorted(true);
}

void test_a_current_of_the_size_of_none_changes_no_side(void)
{
    for (int n = 0; n < 60; n++) {
        short_one_sided(seam.motor.plausibility.i_dead);
        expect_shorted(true);
    }
}

void test_with_a_gate_fault_the_side_is_found_by_trying_alone(void)
{
    drive.fast.faults = FAULT_GATE;
    for (int n = 0; n < 60; n++) {
        short_one_sided(5000);
        expect_shorted(true);
    }
}

/* The gate drivers block the short circuit by the lower switches one period after it was on, because one of the upper
 * switches is shorted. They block that by the upper switches, too, so that switching is disabled. After a reset both
 * sides are tried again. */
void test_a_short_circuit_that_the_gate_drivers_block_is_made_on_the_other_side(void)
{
    seam_run();
    seam_periods(3);
    write_command(SAFE_SHORT_CIRCUIT, FAULT_TEMPERATURE);
    seam_period();
    expect_shorted(true);
    TEST_ASSERT_TRUE(drive_is_shorted(&drive));
    seam.gates_blocked = true;
    seam_period();
    expect_shorted_by_the_upper_switches();
    TEST_ASSERT_FALSE(drive_is_shorted(&drive)); /* the bridge is still blocked */
    seam.gates_blocked = false;
    seam_period();
    expect_shorted_by_the_upper_switches();
    TEST_ASSERT_TRUE(drive_is_shorted(&drive));
    seam.gates_blocked = true;
    seam_period();
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_EQUAL_INT(16384, seam.duty.a);
    seam.gates_blocked = false;
    seam_periods(2);
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_FALSE(drive_is_shorted(&drive));
    command_t command = *command_box_read(&drive.commands);
    command.fault_resets++;
    command_box_write(&drive.commands, command);
    seam_period();
    expect_shorted(true);
}

/* While the fault line is still active from the fault before, no side can be on, and so none has failed. */
void test_while_the_fault_line_is_active_no_side_fails(void)
{
    seam_run();
    seam_periods(3);
    seam.gates_blocked = true;
    write_command(SAFE_SHORT_CIRCUIT, FAULT_GATE);
    seam_periods(2); /* of the search for a shorted switch */
    for (int k = 0; k < 3; k++) {
        seam_period();
        expect_shorted(true);
        TEST_ASSERT_FALSE(drive_is_shorted(&drive));
    }
    seam.gates_blocked = false;
    seam_period();
    expect_shorted(true);
    TEST_ASSERT_TRUE(drive_is_shorted(&drive));
}

void test_a_gate_fault_shorts_the_phases_if_the_task_has_decided_so(void)
{
    for (int n = 0; n < 2; n++) {
        seam_start();
        seam_run();
        seam_periods(3);
        write_command(n == 0 ? SAFE_SHORT_ON_OVER_VOLTAGE : SAFE_SHORT_ON_GATE_FAULT, 0);
        drive_raise_fault(&drive, FAULT_GATE);
        for (int k = 0; k < 2; k++) {
            seam_period();
            expect_shorted(false);
        }
        seam_period();
        expect_shorted(n == 1);
    }
    seam_start();
    seam_run();
    seam_periods(3);
    write_command(SAFE_SHORT_ON_GATE_FAULT, FAULT_TORQUE);
    seam_period();
    expect_shorted(false);
}

/* Currents that stay constant with switching disabled, one out of the bridge and two into it, circulate through an
 * upper switch. The period of the fault shows nothing: the drivers may have switched off late in it. */
void test_a_gate_fault_waits_for_one_period_where_currents_flow(void)
{
    seam_run();
    seam_periods(3);
    write_command(SAFE_SHORT_ON_GATE_FAULT, 0);
    seam_current(15.0, -7.5, -7.5); /* 5 % of the largest are 12.5 A */
    drive_raise_fault(&drive, FAULT_GATE);
    seam_period();
    expect_shorted(false);
    seam_period();
    expect_shorted_by_the_upper_switches();
}

/* A period with switching disabled: its two samples, q15. */
typedef struct {
    ab_q15_t i[2], psi[2];
    dq_q15_t i_dq[2];
    int32_t zero_q28[2];
    uint32_t periods; /* since the fault, at the second sample; 0: there is no first one */
    uint8_t waits;
} searched_t;

/* PSI_C: the third phase is 0.4 of the dc voltage away from the rail of the other two. */
#define V_DC 22938
#define PER_DC (V_DC * 0.3299) /* flux that the dc voltage makes in a period */
#define PSI_C ((int32_t)(0.4 * PER_DC * 2.0 / 3.0))

/* The current flows out of the bridge in phase a and into it in b; the flux changes in the direction of phase c alone,
 * so that a and b have the same voltage, which a switch must have caused. At the beginning the flux is not zero. */
static searched_t period_of(int32_t psi_c, int32_t i)
{
    const ab_q15_t current = {i, -(int32_t)(i / 1.7320508)};
    const dq_q15_t dq = {(q15_t)current.alpha, (q15_t)current.beta};
    return (searched_t){
        .i = {current, current},
        .i_dq = {dq, dq},
        .psi = {{3000, -2000}, {3000 - psi_c / 2, -2000 - (int32_t)(psi_c * SQRT3_HALF)}},
        .periods = 1,
        .waits = 5,
    };
}

static void search_in(const searched_t *given)
{
    seam_start();
    drive.fast.short_circuit.waits = given->waits;
    drive.fast.faults = FAULT_GATE;
    drive.fast.fault_period = 71U - given->periods;
    for (uint32_t k = 0; k < 2U; k++) {
        const sample_t sample = {
            .i_ab = fx_pair(given->i[k].alpha, given->i[k].beta),
            .point = {.i = given->i_dq[k], .flux = {.psi_d = given->psi[k].alpha, .psi_q = given->psi[k].beta}},
            .zero_q28 = given->zero_q28[k],
            .v_dc = V_DC};
        drive.samples.generation = 69U + k;
        if (k == 1U || given->periods != 0U) {
            const safe_period_t now = safe_period(&sample, fx_pair(32767, 0), 0);
            (void)short_circuit_may_begin(&drive, &now);
        }
        drive.samples.slot[(70U + k) % SAMPLE_SLOTS] = sample;
    }
}

static void expect_found(const searched_t *given, bool found, unsigned waits)
{
    search_in(given);
    TEST_ASSERT_EQUAL(found ? SHORT_CIRCUIT_UPPER : SHORT_CIRCUIT_LOWER, drive.fast.short_circuit.side);
    TEST_ASSERT_EQUAL_UINT8(found ? 2 : 0, drive.fast.short_circuit.changes); /* 2: kept from then on */
    TEST_ASSERT_EQUAL_UINT(waits, drive.fast.short_circuit.waits);
}

void test_the_currents_of_a_gate_fault_show_the_side_of_a_shorted_switch(void)
{
    searched_t given = period_of(-PSI_C, 4000);
    expect_found(&given, true, 0);
    given.periods = 0; /* the period of the fault */
    expect_found(&given, false, 5);
    given = period_of(0, 4000); /* nothing to be seen, but a current flows */
    expect_found(&given, false, 0);
    given = period_of(PSI_C, 4000);
    search_in(&given);
    TEST_ASSERT_EQUAL(SHORT_CIRCUIT_LOWER, drive.fast.short_circuit.side);
    TEST_ASSERT_EQUAL_UINT8(2, drive.fast.short_circuit.changes);
}

/* b has turned around late in the period, and its diodes explain the voltages. Without the first sample they would
 * show an upper switch. */
void test_a_current_that_turns_around_within_the_period_of_the_search_is_taken_into_account(void)
{
    searched_t given = period_of(0, 0);
    given.i[0] = (ab_q15_t){8000, 1270};
    given.i[1] = (ab_q15_t){8000, 6466};
    given.psi[1].alpha += (int32_t)(-0.5333 * PER_DC);
    given.psi[1].beta += (int32_t)(-0.2309 * PER_DC);
    given.i_dq[1] = (dq_q15_t){8000, 6466};
    expect_found(&given, false, 0);
    given.i[0] = given.i[1];
    expect_found(&given, true, 0);
}

/* 5 % of the largest are 1024. */
void test_the_search_for_a_shorted_switch_ends_after_two_periods_without_current(void)
{
    for (uint32_t periods = 0; periods < 3U; periods++) {
        searched_t given = period_of(-PSI_C, 0);
        given.periods = periods;
        expect_found(&given, false, periods < 2U ? 5U : 0U);
    }
    static const struct {
        dq_q15_t i;
        unsigned waits;
    } cases[] = {{{1024, 0}, 5}, {{1025, 0}, 0}, {{0, -1024}, 5}, {{0, -1025}, 0}, {{800, 800}, 0}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        searched_t given = period_of(-PSI_C, 0);
        given.i_dq[1] = cases[k].i;
        expect_found(&given, false, cases[k].waits);
    }
}

/* i_dead is 410: half of it has no direction. What shows a switch ends the wait, however small it is. */
void test_a_small_current_shows_a_shorted_switch_too(void)
{
    searched_t given = period_of(-PSI_C, 200);
    expect_found(&given, false, 5);
    given = period_of(-PSI_C, 212);
    expect_found(&given, true, 0);
}

/* The tables end at the largest current, 20480, and are of no use if the currents do not add up. */
void test_currents_without_a_known_flux_show_no_shorted_switch(void)
{
    static const dq_q15_t beyond[] = {{20481, 0}, {0, 20481}, {16000, 16000}};
    searched_t given = period_of(-PSI_C, 4000);
    given.i_dq[0] = given.i_dq[1] = (dq_q15_t){20480, 0};
    expect_found(&given, true, 0);
    for (int end = 0; end < 2; end++) {
        for (int k = 0; k < 3; k++) {
            given = period_of(-PSI_C, 4000);
            given.i_dq[end] = beyond[k];
            expect_found(&given, false, 0);
        }
        given = period_of(-PSI_C, 4000);
        given.zero_q28[end] = -546 * 8192; /* a third of the largest sum */
        expect_found(&given, true, 0);
        given.zero_q28[end] -= 8192;
        expect_found(&given, false, 0);
    }
}

/* Below 6 kHz half a step has fewer periods than the search. */
void test_a_short_circuit_waits_for_the_search_for_a_shorted_switch_if_it_waits_at_all(void)
{
    searched_t given = period_of(-PSI_C, 4000);
    given.waits = 0;
    expect_found(&given, false, 0);
    given.waits = 1;
    expect_found(&given, true, 0);
}

typedef struct {
    uint32_t faults;
    int32_t psi_d, psi_q, psi_d_error;
    dq_q15_t i;
    int32_t zero_q28;
} waiting_t;

static bool begins_at_once(const waiting_t *given)
{
    seam_start();
    drive.psi_d_error = (q15_t)given->psi_d_error;
    drive.fast.short_circuit.waits = 5;
    drive.fast.faults = given->faults;
    const sample_t sample = {.point = {.i = given->i, .flux = {.psi_d = given->psi_d, .psi_q = given->psi_q}},
                             .zero_q28 = given->zero_q28,
                             .v_dc = V_DC};
    const safe_period_t now = safe_period(&sample, fx_pair(32767, 0), 0);
    return short_circuit_may_begin(&drive, &now);
}

/* The wait would raise a smaller flux to that of the magnets. */
void test_a_short_circuit_begins_at_once_with_less_flux_than_that_of_the_magnets(void)
{
    const int32_t psi_f = motor.safe_state.psi_f;
    const waiting_t less[] = {
        {.faults = FAULT_CONTROL, .psi_d = psi_f - 1},
        {.faults = FAULT_PHASE_LOST, .psi_q = 1 - psi_f},
        {.faults = FAULT_CONTROL | FAULT_PHASE_LOST, .psi_d = psi_f / 2, .psi_q = psi_f / 2, .i = {-20480, 0}},
        {.faults = FAULT_CONTROL, .psi_d = psi_f + 99, .psi_d_error = -100},
    };
    const waiting_t not_less[] = {
        {.faults = FAULT_CONTROL, .psi_d = psi_f},
        {.faults = FAULT_CONTROL, .psi_q = -psi_f},
        {.faults = FAULT_CONTROL, .psi_d = psi_f / 4 * 3, .psi_q = psi_f / 4 * 3},
        {.faults = FAULT_CONTROL, .psi_d = psi_f - 100, .psi_d_error = 100},
    };
    for (unsigned k = 0; k < 4U; k++) {
        TEST_ASSERT_TRUE(begins_at_once(&less[k]));
        TEST_ASSERT_FALSE(begins_at_once(&not_less[k]));
    }
}

/* After every other fault the samples may be wrong; the tables end at the largest current, 20480. */
void test_a_short_circuit_waits_where_its_flux_is_not_known(void)
{
    const waiting_t known = {.faults = FAULT_CONTROL};
    TEST_ASSERT_TRUE(begins_at_once(&known));
    for (unsigned bit = 0; bit < 16U; bit++) {
        const uint32_t fault = (uint32_t)1 << bit;
        const bool is_at_once = fault == FAULT_OVER_VOLTAGE || fault == FAULT_CONTROL || fault == FAULT_PHASE_LOST;
        const waiting_t given = {.faults = FAULT_CONTROL | fault};
        TEST_ASSERT_EQUAL(is_at_once, begins_at_once(&given));
    }
    const waiting_t beyond = {.faults = FAULT_CONTROL, .i = {-20481, 0}};
    const waiting_t no_sum = {.faults = FAULT_CONTROL, .zero_q28 = -547 * 8192};
    TEST_ASSERT_FALSE(begins_at_once(&beyond));
    TEST_ASSERT_FALSE(begins_at_once(&no_sum));
}

/* The first flux of a search is never that of an earlier one. */
void test_while_the_bridge_runs_the_flux_of_an_earlier_search_is_discarded(void)
{
    drive.fast.short_circuit.open_switch.has_begun = true;
    short_circuit_prepare(&drive.fast, 5);
    TEST_ASSERT_FALSE(drive.fast.short_circuit.open_switch.has_begun);
}

/* Switching is disabled, the machine turns slowly, and 100 A still flow in the next steps of the task. */
void test_a_current_with_switching_disabled_is_a_gate_fault_and_shorts_the_phases(void)
{
    seam_run();
    seam_periods(15);
    drive_raise_fault(&drive, FAULT_TORQUE);
    seam_periods(10);
    expect_shorted(false);
    seam_current(100.0, -50.0, -50.0);
    seam_periods(40);
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE | FAULT_GATE, drive.fast.faults);
    TEST_ASSERT_TRUE(drive.task.gate_fault.switch_shorted);
    expect_shorted(true);
}

/* Over-voltage needs two samples in a row. A good sample between two bad ones, which alone takes the fast route of the
 * period, must reset the count. */
void test_single_samples_of_over_voltage_with_good_ones_between_are_no_fault(void)
{
    seam_run();
    seam_periods(5);
    for (int n = 0; n < 4; n++) {
        seam_voltage(450.0);
        seam_period();
        TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
        seam_voltage(350.0);
        seam_period();
    }
    TEST_ASSERT_TRUE(published()->acting);
}

/* As fast as a link can: by less than a sixth of its upper limit in a period. */
static void raise_voltage(void)
{
    seam_voltage(400.0);
    seam_period();
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    seam_voltage(450.0);
    seam_period();
}

/* The two samples before the present one count, not an older one. */
void test_a_higher_voltage_before_the_rise_does_not_delay_the_over_voltage(void)
{
    seam_run();
    seam_periods(3);
    seam_voltage(400.0);
    seam_period();
    seam_voltage(350.0);
    seam_period();
    raise_voltage();
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_VOLTAGE, drive.fast.faults);
}

/* The over-voltage that the rise announces does not replace what the monitors find in the same sample. */
void test_an_over_current_in_the_sample_of_the_over_voltage_is_a_fault_too(void)
{
    seam_run();
    seam_periods(3);
    seam_voltage(400.0);
    seam_period();
    seam_voltage(450.0);
    seam_current(310.0, -155.0, -155.0);
    seam_period();
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_CURRENT | FAULT_OVER_VOLTAGE, drive.fast.faults);
}

static void run_until_over_voltage_shorts(void)
{
    seam_run();
    seam_periods(3);
    write_command(SAFE_SHORT_ON_OVER_VOLTAGE, 0);
    raise_voltage();
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_VOLTAGE, drive.fast.faults);
    expect_shorted(true);
}

void test_an_over_voltage_shorts_the_phases_if_the_task_has_decided_so(void)
{
    run_until_over_voltage_shorts();
    seam_periods(30); /* the task keeps the short circuit while the voltage is high */
    expect_shorted(true);
    seam_voltage(350.0);
    seam_periods(1950); /* for 200 steps with a low voltage, too */
    expect_shorted(true);
    seam_periods(80);
    expect_shorted(false);
}

/* The machine stands: the voltage is not its work. */
void test_an_over_voltage_of_the_battery_disables_switching(void)
{
    seam_run();
    seam_periods(3);
    raise_voltage();
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_VOLTAGE, drive.fast.faults);
    expect_shorted(false);
    seam_periods(30);
    expect_shorted(false);
}

/* No link rises so fast: the sensor is wrong, whatever the machine generates. */
void test_an_over_voltage_by_a_jump_of_the_sensor_disables_switching(void)
{
    seam_run();
    seam_periods(3);
    write_command(SAFE_SHORT_ON_OVER_VOLTAGE, 0);
    seam_voltage(450.0);
    seam_period();
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    for (int n = 0; n < 30; n++) {
        seam_period();
        TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_VOLTAGE, drive.fast.faults);
        expect_shorted(false);
    }
}

/* What was said about an earlier jump does not hold for the next over-voltage. */
void test_an_over_voltage_after_one_of_the_sensor_shorts_the_phases_again(void)
{
    seam_run();
    seam_periods(3);
    seam_voltage(450.0);
    seam_periods(3);
    TEST_ASSERT_TRUE(drive.fast.short_circuit.ignores_voltage);
    seam_voltage(350.0);
    drive.request.enable = false;
    seam_periods(20);
    drive.request.fault_resets++;
    seam_periods(34); /* a step of the task begins with the next period */
    run_until_over_voltage_shorts();
}

static bool is_needed(uint32_t faults, safe_t safe)
{
    const fast_state_t fast = {.faults = faults};
    return short_circuit_is_needed(&fast, safe);
}

void test_each_decision_shorts_the_phases_on_its_own_faults_only(void)
{
    static const struct {
        safe_t safe;
        bool on_over_voltage, on_gate_fault, on_other;
    } expected[] = {
        {SAFE_FREEWHEEL, false, false, false},          {SAFE_SHORT_ON_OVER_VOLTAGE, true, false, false},
        {SAFE_SHORT_ON_GATE_FAULT, false, true, false}, {SAFE_SHORT_ON_EITHER, true, true, false},
        {SAFE_SHORT_CIRCUIT, true, true, true},
    };
    for (unsigned n = 0; n < sizeof expected / sizeof expected[0]; n++) {
        const safe_t safe = expected[n].safe;
        TEST_ASSERT_EQUAL(expected[n].on_over_voltage, is_needed(FAULT_OVER_VOLTAGE, safe));
        TEST_ASSERT_EQUAL(expected[n].on_gate_fault, is_needed(FAULT_GATE, safe));
        TEST_ASSERT_EQUAL(expected[n].on_other, is_needed(FAULT_ANGLE, safe));
    }
}

void test_an_over_voltage_never_enables_a_bridge_that_has_not_run(void)
{
    seam_voltage(450.0);
    seam_periods(30);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_VOLTAGE, drive.fast.faults);
    expect_shorted(false);
}

void test_a_fault_of_the_tasks_monitors_is_latched_and_disables_switching(void)
{
    seam_run();
    seam_periods(3);
    write_command(SAFE_FREEWHEEL, FAULT_TORQUE | FAULT_PHASE_LOST);
    seam_period();
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE | FAULT_PHASE_LOST, drive.fast.faults);
    TEST_ASSERT_FALSE(seam.gates);
    write_command(SAFE_FREEWHEEL, 0);
    seam_period();
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE | FAULT_PHASE_LOST, drive.fast.faults);
}

void test_a_fault_raised_elsewhere_disables_switching_in_the_next_period(void)
{
    seam_run();
    seam_periods(3);
    drive_raise_fault(&drive, FAULT_INPUT);
    seam_period();
    TEST_ASSERT_FALSE(seam.gates);
}

void test_an_unpowered_dc_link_is_a_fault_only_while_switching(void)
{
    seam_voltage(0.0);
    seam_periods(50);
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    seam_run();
    seam_period();
    TEST_ASSERT_EQUAL_HEX32(FAULT_UNDER_VOLTAGE, drive.fast.faults);
    TEST_ASSERT_FALSE(seam.gates);
}

void test_an_over_voltage_while_the_drive_is_off_is_a_fault_too(void)
{
    seam_voltage(500.0);
    seam_periods(2);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_VOLTAGE, drive.fast.faults);
}

/* Until then the predicted angle is used, so that the currents stay in the frame of the rotor. */
void test_an_angle_that_jumps_is_not_followed_and_is_a_fault_when_it_stays(void)
{
    seam_periods(5);
    seam.theta_m = 0x40000000u / 3U;
    for (int n = 1; n < 66; n++) {
        seam_period();
        TEST_ASSERT_EQUAL_HEX32(0, published()->theta_e);
    }
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    seam_period();
    TEST_ASSERT_EQUAL_HEX32(FAULT_ANGLE, drive.fast.faults);
    seam_period(); /* from this period on the tracker follows the new angle */
    TEST_ASSERT_EQUAL_HEX32(0x3FFFFFFFu, published()->theta_e);
    seam_periods(400);
    TEST_ASSERT_EQUAL_HEX32(0x3FFFFFFFu, published()->theta_e);
    TEST_ASSERT_EQUAL(0, drive.fast.monitor.pending);
}

void test_a_glitch_of_the_angle_of_50_samples_is_no_fault_and_the_bridge_runs_on(void)
{
    seam_run();
    seam_periods(5);
    seam.theta_m = 0x40000000u / 3U;
    seam_periods(50);
    TEST_ASSERT_EQUAL_HEX32(0, published()->theta_e);
    seam.theta_m = 0;
    seam_periods(300);
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    TEST_ASSERT_TRUE(seam.gates);
    TEST_ASSERT_TRUE(drive.fast.is_settled);
}

/* 5 10^7 of a mechanical turn per period are 6980 rpm; what is measured then is the prediction. */
void test_an_angle_that_freezes_for_5_ms_is_replaced_and_is_a_fault_when_it_stays_so(void)
{
    for (int samples = 50; samples <= 70; samples += 20) {
        setUp();
        slow_monitors_without_machine(&seam.motor);
        seam_run();
        for (int n = 0; n < 400; n++) {
            seam.theta_m += 50000000U;
            seam_period();
        }
        TEST_ASSERT_TRUE(drive.fast.is_settled);
        uint32_t theta = seam.theta_m;
        for (int n = 0; n < samples; n++) {
            theta += 50000000U;
            seam_period();
            if (n > 0 && n < 65) { /* the first repeat is noticed at the end of its period */
                TEST_ASSERT_INT_WITHIN(25000000, 0, (int32_t)(published()->theta_e - 3U * theta)); /* 2 degrees */
            }
        }
        TEST_ASSERT_EQUAL_HEX32(samples > 65 ? FAULT_ANGLE : 0, drive.fast.faults);
        TEST_ASSERT_EQUAL(samples <= 65, seam.gates);
    }
}

/* 10^6 per period are 140 rpm: such a rotor can stop within 5 ms. */
void test_a_slow_angle_that_freezes_is_replaced_for_5_ms_and_then_that_of_a_rotor_at_rest(void)
{
    seam_run();
    for (int n = 0; n < 2000; n++) {
        seam.theta_m += 1000000U;
        seam_period();
    }
    const uint32_t frozen = seam.theta_m;
    for (int n = 1; n <= 50; n++) {
        seam_period();
        TEST_ASSERT_INT_WITHIN(12000000, 0, (int32_t)(published()->theta_e - 3U * (frozen + (uint32_t)n * 1000000U)));
    }
    seam_periods(2); /* the first repeat was noticed at the end of its period */
    TEST_ASSERT_EQUAL_HEX32(3U * frozen, published()->theta_e);
    TEST_ASSERT_EQUAL_INT32(0, published()->point.omega);
    seam_periods(100);
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    TEST_ASSERT_TRUE(drive.fast.is_settled);
}

/* Its own law on the checked route, which is never left. */
void test_a_motor_whose_field_turns_far_runs_on_its_own_law(void)
{
    seam.motor.turning_control = (turning_control_config_t){.per_period_q29 = Q31(0.5),
                                                            .approach_q32 = Q31(0.72),
                                                            .feedback_q32 = Q31(0.56),
                                                            .integral_q32 = Q31(0.09),
                                                            .knee_turns_q27 = INT32_MAX};
    seam.motor.parameters.current_control.sigma_q24 = 0;
    seam.motor.parameters.current_control.integral_gain = 0;
    drive.parameters.current_control = seam.motor.parameters.current_control;
    seam_run();
    seam_period();
    seam_current(30.0, -15.0, -15.0);
    seam_periods(4);
    TEST_ASSERT_TRUE(seam.gates);
    TEST_ASSERT_FALSE(drive.fast.is_settled);
    TEST_ASSERT_TRUE(published()->acting);
    TEST_ASSERT_EQUAL_INT32(0, drive.fast.current_control.s_d_q30);
    TEST_ASSERT_NOT_EQUAL_INT32(0, drive.fast.turning_control.s.d);
    drive.request.enable = false;
    seam_periods(20);
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_EQUAL_INT32(0, drive.fast.turning_control.s.d);
    TEST_ASSERT_EQUAL_INT32(published()->point.flux.psi_d * 16384, drive.fast.turning_control.next.d);
}

/* (MO-12): 2^-10 turns divide the gain, and the knee is never narrower than the given one. */
void test_where_the_field_turns_far_the_knee_widens_with_speed(void)
{
    const modulate_config_t given = {.knee_q17 = 1 << 20, .knee_side_q17 = 908093, .dead_time_q16 = 77};
    const modulate_config_t at_rest = turning_modulate(&given, 10 << 20, 0);
    TEST_ASSERT_EQUAL_MEMORY(&given, &at_rest, sizeof given);
    const modulate_config_t slow = turning_modulate(&given, 10 << 20, 9 << 22);
    TEST_ASSERT_EQUAL_MEMORY(&given, &slow, sizeof given);
    modulate_config_t rounded = given;
    rounded.knee_side_q17 = 908000; /* of the generated data: an equal knee is no reason to compute it again */
    const modulate_config_t equal = turning_modulate(&rounded, 11 << 20, 11 << 22);
    TEST_ASSERT_EQUAL_MEMORY(&rounded, &equal, sizeof rounded);
    for (int sign = -1; sign <= 1; sign += 2) {
        const modulate_config_t fast = turning_modulate(&given, 10 << 20, sign * (101 << 22));
        TEST_ASSERT_EQUAL_INT32((10 << 20) / 101, fast.knee_q17);
        TEST_ASSERT_INT32_WITHIN(1, (int32_t)(0.8660254 * (10 << 20) / 101), fast.knee_side_q17);
        TEST_ASSERT_EQUAL_INT32(77, fast.dead_time_q16);
    }
}

/* The voltage computed in period k acts in period k + 1, so the published one was computed in the previous period. */
void test_the_published_voltage_is_the_one_that_acts_now(void)
{
    seam_run();
    seam_period();
    TEST_ASSERT_EQUAL_INT(0, published()->point.u.d);
    drive.fast.u_next = (dq_q15_t){1234, -567};
    seam_period();
    TEST_ASSERT_EQUAL_INT(1234, published()->point.u.d);
    TEST_ASSERT_EQUAL_INT(-567, published()->point.u.q);
}

/* The duties of period 1 act in period 2; the first period whose whole voltage is known ends with sample 3. */
void test_the_identification_gets_voltages_only_after_the_bridge_has_acted_for_a_whole_period(void)
{
    seam_run();
    seam_period();
    TEST_ASSERT_FALSE(published()->acting);
    seam_period();
    TEST_ASSERT_FALSE(published()->acting);
    seam_period();
    TEST_ASSERT_TRUE(published()->acting);
    seam_current(310.0, -155.0, -155.0);
    seam_period();
    TEST_ASSERT_FALSE(published()->acting);
    TEST_ASSERT_EQUAL_INT(0, published()->point.u.d);
}

void test_the_samples_are_published_in_the_rotors_frame(void)
{
    seam.theta_m = 0x40000000u / 3U; /* 90 electrical degrees: the current of phase a is -i_q */
    seam_current(100.0, -50.0, -50.0);
    seam_periods(3);
    const double lsb = 400.0 / 32768.0;
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 0.0, published()->point.i.d * lsb);
    TEST_ASSERT_DOUBLE_WITHIN(0.3, -100.0, published()->point.i.q * lsb);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 350.0, published()->v_dc * 540.0 / 32768.0);
}

/* While an identification does not finish, samples are still published; the third overrun in a row is a fault. */
void test_three_unfinished_identifications_in_a_row_are_an_overrun(void)
{
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    seam_run();
    fast_isr(&drive);
    mrai_isr(&drive);
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
        seam.log[0] = '\0';
        fast_isr(&drive);
    }
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    fast_isr(&drive);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVERRUN, drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(3, mrai_overruns(&drive));
    fast_isr(&drive);
    TEST_ASSERT_FALSE(seam.gates);
}

void test_an_identification_that_is_sometimes_late_is_counted_and_is_no_fault(void)
{
    drive.request.identification_mode = IDENTIFICATION_PAPER;
    seam_run();
    for (int n = 0; n < 9; n++) {
        seam.log[0] = '\0';
        fast_isr(&drive);
        if (n % 3 == 2) {
            mrai_isr(&drive);
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(6, mrai_overruns(&drive));
}

/* The generation of the last period that went to the law tells. */
static void expect_windows(const char *acting)
{
    for (; *acting != '\0'; acting++) {
        const uint32_t seen = drive.windows.generation;
        seam_periods(10 - (int)(drive.samples.generation % 10U));
        TEST_ASSERT_EQUAL_UINT32(seen + 1U, drive.windows.generation);
        TEST_ASSERT_EQUAL(*acting == '1', window_box_at(&drive.windows)->acting);
    }
}

static void periods_of(identification_mode_t mode, int count)
{
    drive.request.identification_mode = mode;
    seam_periods(count);
}

void test_a_window_that_lacks_a_period_or_its_first_sample_is_invalid_and_the_next_one_is_not(void)
{
    static const int before[] = {0, 1, 5, 9};
    for (unsigned n = 0; n < sizeof before / sizeof before[0]; n++) {
        for (int lacking = 1; lacking <= 23; lacking++) {
            seam_start();
            seam_run();
            seam_periods(30 + before[n]);
            periods_of(IDENTIFICATION_PAPER, lacking);
            drive.request.identification_mode = IDENTIFICATION_ROBUST;
            expect_windows("011");
        }
    }
}

static void fast_isr_alone(identification_mode_t mode)
{
    drive.request.identification_mode = mode;
    seam.log[0] = '\0';
    fast_isr(&drive);
}

/* The law takes the last period but one of a window and is still at work in the first one of the next. */
void test_a_window_without_a_period_for_which_the_law_was_late_is_invalid(void)
{
    seam_run();
    seam_periods(38);
    fast_isr_alone(IDENTIFICATION_PAPER);
    fast_isr_alone(IDENTIFICATION_ROBUST);
    TEST_ASSERT_FALSE(window_box_at(&drive.windows)->acting);
    fast_isr_alone(IDENTIFICATION_PAPER);
    TEST_ASSERT_EQUAL_UINT32(1, mrai_overruns(&drive));
    mrai_isr(&drive);
    drive.request.identification_mode = IDENTIFICATION_ROBUST;
    expect_windows("01");
}

/* 2^31 periods are 60 hours at 10 kHz. */
void test_without_the_papers_identification_windows_are_valid_at_any_time(void)
{
    seam_run();
    seam_periods(30);
    for (uint32_t share = 1; share < 16U; share++) {
        drive.samples.generation = share << 28U;
        drive.fast.step_end = drive.samples.generation + 10U;
        seam_periods(10);
        TEST_ASSERT_TRUE(window_box_at(&drive.windows)->acting);
    }
}

/* Number of periods without the task, after its last command, until switching is disabled. */
static int periods_until_disabled(void)
{
    int count = 0;
    while (seam.gates && count < 100) {
        seam.log[0] = '\0';
        const int before = seam.pended;
        fast_isr(&drive);
        if (seam.pended != before) {
            mrai_isr(&drive);
        }
        count++;
    }
    return count;
}

/* The last command is written in each of the ten periods of a window in turn. */
static void check_stopped_task(identification_mode_t mode)
{
    for (int phase = 0; phase < 10; phase++) {
        seam_start();
        drive.request.identification_mode = mode;
        seam_run();
        seam_periods(30);
        for (int n = 0; n < phase; n++) {
            seam_period();
        }
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
        TEST_ASSERT_TRUE(seam.gates);
        const int count = periods_until_disabled();
        TEST_ASSERT_TRUE(count > 20 && count <= 31); /* the safe state acts in the period after the third window */
        TEST_ASSERT_EQUAL_HEX32(FAULT_OVERRUN, drive.fast.faults);
    }
}

void test_a_task_that_stops_while_the_bridge_runs_brings_the_safe_state_within_three_steps(void)
{
    check_stopped_task(IDENTIFICATION_ROBUST);
    check_stopped_task(IDENTIFICATION_PAPER);
}

void test_a_task_that_is_a_step_late_is_no_fault(void)
{
    seam_run();
    seam_periods(30);
    for (int n = 0; n < 20; n++) {
        for (int k = 0; k < 19; k++) {
            seam.log[0] = '\0';
            fast_isr(&drive);
        }
        task_1khz(&drive);
    }
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    TEST_ASSERT_TRUE(seam.gates);
}

/* Before the first command, and while the drive is not enabled, there is no torque that could last too long. */
void test_without_a_command_to_run_a_stopped_task_is_no_fault(void)
{
    for (int n = 0; n < 100; n++) {
        seam.log[0] = '\0';
        fast_isr(&drive);
    }
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
}

void test_switching_on_starts_without_the_integrators_of_the_last_run(void)
{
    seam_run();
    seam_periods(3);
    drive.fast.current_control.s_q_q30 = 250000000;
    drive.request.enable = false;
    task_1khz(&drive);
    seam_period();
    TEST_ASSERT_EQUAL_INT32(0, drive.fast.current_control.s_q_q30);
    TEST_ASSERT_FALSE(seam.gates);
    seam_run();
    seam_period();
    TEST_ASSERT_TRUE(seam.gates);
    TEST_ASSERT_INT_WITHIN(700, 16384, seam.duty.a); /* the small voltage of the first period at zero current */
}

/* A dc voltage too small to compute duties from: neither identification may take the commanded voltage for the acting
 * one. */
void test_a_dc_voltage_below_its_bound_makes_the_acting_voltage_unknown(void)
{
    seam_run();
    seam_periods(4);
    TEST_ASSERT_TRUE(published()->acting);
    seam_voltage(100.0); /* the bound is 140 V */
    seam_period();
    TEST_ASSERT_FALSE(published()->acting);
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    seam_voltage(350.0);
    seam_period();
    TEST_ASSERT_FALSE(published()->acting);
    seam_period();
    TEST_ASSERT_TRUE(published()->acting);
}

void test_a_voltage_at_its_limit_is_reported_to_the_task(void)
{
    seam_run();
    seam_periods(2);
    TEST_ASSERT_FALSE(published()->voltage_limited);
    drive.fast.current_control.s_q_q30 = 1000000000;
    seam_period();
    TEST_ASSERT_TRUE(published()->voltage_limited);
}

void test_two_drives_in_one_process_share_nothing(void)
{
    static drive_t other;
    drive_init(&other, &motor);
    seam_run();
    seam_periods(3);
    seam.log[0] = '\0';
    fast_isr(&other);
    TEST_ASSERT_FALSE(seam.gates); /* the other one is off */
    TEST_ASSERT_EQUAL_INT(1, other.samples.generation);
    TEST_ASSERT_EQUAL_INT(3, drive.samples.generation);
}
