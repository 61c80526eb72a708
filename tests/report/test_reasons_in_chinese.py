"""What the tests say of a mistake in a measured record has its Chinese, or the report of that record is refused."""

from __future__ import annotations

import pytest

from gyrobench.report.language import Language, catalogue, system_folder

SAID = {
    "angle_system_test": (
        "Readings lie outside the noise of the others: at 45.80° (+4.9″). They are in the estimates. Look for the "
        "cause, and leave them out only if it is one.",
        "Readings lie outside the noise of the others: at 49.74° (−0.63″), 45.80° (−0.663″) and 5 more. They are in "
        "the estimates. Look for the cause, and leave them out only if it is one.",
        "The scale drifts against the reference, by +1.4″ from the first position to the last. Low harmonics hold part "
        "of it where the positions follow one another around the turn. Wait until the temperature is even, or go to "
        "the positions in an irregular order.",
        "runs, residuals: p < 0.001, neighbours have the same sign too often. The stated u may be too small.",
    ),
    "table_position_test": (
        "Polygon and second head contradict each other in what both tell of the position: E3 cos is −0.361″ by the "
        "autocollimator and 0.363″ by the heads (p < 0.001). They agree with the autocollimator's sign reversed, or "
        "the sign of the second head reversed: was that mistaken?",
        "Errors of the places and of the faces do not explain what the autocollimator read in all mounts (p < 0.001). "
        "They do with mount 60° at 30°: was that mistaken?",
        "No residual of this record would show: the scale of the autocollimator wrong by 2 % (E1 sin by 3.4 u). State "
        "its uncertainty (u_scale), or that units and scales were checked (arrangement = checked).",
    ),
    "drift_record": (
        "The slow drift may be a curve that is no noise: it falls faster with frequency than its terms do (p = 0.02). K"
        ", R and slow processes are those of this curve, and another record need not have them. Repeat the record, "
        "with the temperature beside the rate.",
        "gyro_x: The slow drift may be a curve that is no noise: it falls faster with frequency than its terms do (p < "
        "0.001). K, R and slow processes are those of this curve, and another record need not have them. Repeat the "
        "record, with the temperature beside the rate.",
        "The slow drift may be a curve that is no noise: what was taken out of it settles or has few cycles, and need "
        "not be an exponential or a sine. K, R and slow processes are those of this curve, and another record need not "
        "have them. Repeat the record, with the temperature beside the rate.",
        "K and R are of the one drift curve of this record: a curve that is no noise, a bend or a bump, may look the "
        "same. What stays in a second record is the instrument's.",
    ),
    "sculling_test": (
        "From row 73 on the level of the record is another one, by +2.84 µg (7 standard deviations). The estimates "
        "take it for slow noise, or for what was done then. Look for the cause, and measure again or leave the rows "
        "before or after it out.",
        "the motions of rows 8 and 9 exchanged",
    ),
    "gyro_bandwidth": (
        "What the response does between the points, about the resonance at 46.98 Hz, decides on f_3dB, order. Measure "
        "more frequencies there.",
        "Curve: 2 poles, a delay and a resonance at 46.98 Hz, of the least Bayesian information criterion.",
    ),
    "rate_table_test": (
        "No small rates were measured, and a dead band or a lock-in that the others do not show moves e, a, c and b. "
        "Measure small rates.",
    ),
    "vibration_rectification": (
        "What fades after the axis was turned over, as heat that another attitude moves, is not told from a drift of "
        "the accelerometer. Wait longer before the first reading of a position.",
        "the first readings of a level hold some of the level before: wait longer, or leave them out",
        "the levels of rows 9 and 10 exchanged",
        "The gyro reads the same up and down, where the vertical Earth rate is 10.64 °/h: was it not turned over, or "
        "does another axis stand up?",
        "No residual of this record would show: a lean of the instruments by 1° with the axis up (b_g by 2.5 u); the "
        "axis x of the gyro level, or the Earth rate taken off before (G by 3 u); the rates wrong by 2 % (G by 2 u). "
        "State that attitudes, angles and values were checked (arrangement = checked), or add positions that show "
        "them.",
    ),
    "turn_on_repeatability": (
        "warm-up of each turn-on: p < 0.001, the warm-up differs from turn-on to turn-on: some began before the gyro "
        "was cold, or at another temperature. The stated u may be too small.",
        "13 readings of mean, the first in row 1, are its largest value to the last digit, and no two others are "
        "alike: a range was reached. What was beyond it is not in the estimates.",
        "No residual of this record would show: the temperatures in °F and given as °C (b_T by 51 u); another "
        "attitude, by 1°, from turn-on 4 on (b by 7 u); the temperature wrong by 1 K (b_T by 2 u). State that "
        "attitudes, angles and values were checked (arrangement = checked), or add positions that show them.",
    ),
}


@pytest.mark.parametrize(("system", "text"), [(s, t) for s, texts in SAID.items() for t in texts])
def test_a_mistake_is_said_in_chinese(system: str, text: str) -> None:
    names = frozenset(f"E{n} {part}" for n in (1, 2, 3) for part in ("cos", "sin"))
    assert Language(catalogue("zh", system_folder(system)), names=names).has(text)
