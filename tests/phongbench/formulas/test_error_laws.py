"""The closed-form laws hold on a dense float64 grid, each within the tolerance its docstring states."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from phongbench.formulas import error_laws, slopes

Vector = npt.NDArray[np.float64]

ALPHAS = (5.0, 10.0, 20.0, 50.0, 64.0, 100.0, 128.0, 200.0, 1000.0, 5000.0)
GAMMAS = (2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0)


def grid(alpha: float, points: int = 120_001) -> Vector:
    """lambda from 0 to 1, or to u = 40 where a narrow lobe has long ended."""
    return np.linspace(0.0, min(1.0, 40.0 / alpha), points)


def phong(lam: Vector, alpha: float) -> Vector:
    return np.clip(1.0 - lam, 0.0, None) ** alpha


def lyon(lam: Vector, beta: float, gamma: float) -> Vector:
    return np.clip(1.0 - beta * lam, 0.0, None) ** gamma


def extreme(error: Vector) -> float:
    return float(error[np.argmax(np.abs(error))])


@pytest.mark.parametrize("gamma", GAMMAS)
@pytest.mark.parametrize("alpha", ALPHAS)
def test_law_1_gives_the_extreme_error_of_the_dot_form(alpha: float, gamma: float) -> None:
    lam = grid(alpha)
    measured = extreme(phong(lam, alpha) - lyon(lam, alpha / gamma, gamma))
    assert error_laws.lyon_taylor_dot(alpha, gamma) == pytest.approx(
        measured, rel=0.04 if gamma == 2 else 0.01, abs=1e-9
    )


@pytest.mark.parametrize("gamma", GAMMAS)
@pytest.mark.parametrize("alpha", ALPHAS[1:])
def test_law_2_gives_the_extreme_error_of_the_cross_form(alpha: float, gamma: float) -> None:
    lam = grid(alpha)
    measured = extreme(phong(lam, alpha) - lyon(lam - lam * lam / 2, alpha / gamma, gamma))
    assert error_laws.lyon_taylor_cross(alpha, gamma) == pytest.approx(
        measured, rel=0.04 if gamma == 2 else 0.01, abs=1e-9
    )


@pytest.mark.parametrize(
    ("alpha", "gamma", "expected"),
    [
        (64, 8, 0.03106),
        (128, 16, 0.01516),
        (256, 8, 0.03425),
        (50, 4, 0.06840),
        (1000, 8, 0.03503),
        (10, 4, 0.04596),
        (10, 16, -0.01073),
    ],
)
def test_law_1_reproduces_the_worked_examples(alpha: float, gamma: float, expected: float) -> None:
    assert error_laws.lyon_taylor_dot(alpha, gamma) == pytest.approx(expected, rel=0.01)


def half_lambda(lam: Vector) -> Vector:
    """1 - N.H for coplanar vectors: half the angle."""
    return 1.0 - np.sqrt(1.0 - lam / 2.0)


def tan2_lambda(lam: Vector) -> Vector:
    x = np.maximum(1.0 - lam, 1e-9)
    return (1.0 - x * x) / (2.0 * x * x)


@pytest.mark.parametrize("alpha", [32.0, 100.0, 1000.0])
@pytest.mark.parametrize("form", sorted(error_laws.KAPPA))
def test_law_3_leads_every_form(form: str, alpha: float) -> None:
    lam = grid(alpha)
    forms = {"cross": lam - lam * lam / 2, "half": 4 * half_lambda(lam), "tan2": tan2_lambda(lam)}
    kappa = error_laws.KAPPA[form]
    for gamma in (4.0, 8.0, 16.0, 32.0):
        measured = extreme(phong(lam, alpha) - lyon(forms.get(form, lam), alpha / gamma, gamma))
        slack = 0.1 * abs(1 / gamma**2 - (kappa / alpha) ** 2) + 2.0 * kappa**2 / alpha**2
        assert abs(error_laws.leading(alpha, gamma, kappa) - measured) <= slack, (form, alpha, gamma)


def test_the_sharpest_law_of_each_form_is_chosen_by_name() -> None:
    assert (
        error_laws.lyon_taylor("dot", 50.0, 8.0)
        == error_laws.lyon_taylor("difference", 50.0, 8.0)
        == error_laws.lyon_taylor_dot(50.0, 8.0)
    )
    assert error_laws.lyon_taylor("cross", 50.0, 8.0) == error_laws.lyon_taylor_cross(50.0, 8.0)
    assert error_laws.lyon_taylor("tan2", 50.0, 8.0) == error_laws.leading(50.0, 8.0, -2.0)
    with pytest.raises(KeyError):
        error_laws.lyon_taylor("none", 50.0, 8.0)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_law_7_gives_the_extreme_error_of_the_classic_gaussian(alpha: float) -> None:
    lam = grid(alpha)
    measured = extreme(phong(lam, alpha) - np.exp(-alpha * lam))
    assert error_laws.gaussian_classic(alpha) == pytest.approx(measured, rel=0.01)


def test_law_4_names_the_smallest_gamma_for_one_code() -> None:
    gammas = 2.0 ** np.arange(1, 9)
    wanted = {10: None, 20: 16, 32: 32, 64: 64, 128: 64, 256: 64, 1000: 128, 5000: 128}
    for alpha, smallest in wanted.items():
        within = gammas[abs(error_laws.lyon_taylor_dot(float(alpha), gammas)) <= 1 / 255]
        assert (within[0] if len(within) else None) == smallest


def best_slope(alpha: float, gamma: float) -> float:
    """Numeric minimax slope: where the two extremes balance, by bisection; a steeper lobe is darker everywhere."""
    lam = grid(alpha, 60_001)
    exact = phong(lam, alpha)
    low, high = 0.7 * alpha / gamma, 1.2 * alpha / gamma
    for _ in range(40):
        middle = 0.5 * (low + high)
        error = exact - lyon(lam, middle, gamma)
        low, high = (low, middle) if error.max() > -error.min() else (middle, high)
    return 0.5 * (low + high)


@pytest.mark.parametrize(("gamma", "tolerance"), [(2.0, 6e-3), (4.0, 1e-3), (8.0, 1e-4), (16.0, 1e-4), (32.0, 1e-4)])
@pytest.mark.parametrize("alpha", [50.0, 200.0, 1000.0])
def test_law_5_gives_the_minimax_slope(alpha: float, gamma: float, tolerance: float) -> None:
    assert slopes.beta("minimax", alpha, gamma) == pytest.approx(best_slope(alpha, gamma), rel=tolerance)


@pytest.mark.parametrize(("alpha", "gamma", "error"), [(50, 8, 0.01363), (200, 16, 0.00734), (1000, 8, 0.01603)])
def test_law_5_more_than_halves_the_error(alpha: float, gamma: float, error: float) -> None:
    lam = grid(alpha)
    measured = abs(extreme(phong(lam, alpha) - lyon(lam, slopes.beta("minimax", alpha, gamma), gamma)))
    assert measured == pytest.approx(error, rel=0.01)
    assert float(error_laws.lyon_taylor_dot(alpha, gamma)) / measured == pytest.approx(2.2, rel=0.03)


def test_the_energy_slope_keeps_the_integral_of_the_lobe() -> None:
    lam = np.linspace(0.0, 1.0, 1_000_001)
    for alpha, gamma in ((10.0, 4.0), (50.0, 8.0), (200.0, 64.0)):
        value = lyon(lam, slopes.beta("energy", alpha, gamma), gamma)
        assert np.trapezoid(value, lam) == pytest.approx(1.0 / (alpha + 1.0), rel=1e-6)


def stretched(lam: Vector, e: float, d: float) -> dict[str, Vector]:
    """The three forms of lambda for lengths 1 + e and 1 + d, straight from their definitions."""
    a, b, x = 1.0 + e, 1.0 + d, 1.0 - lam
    return {
        "dot": 1.0 - a * b * x,
        "difference": 0.5 * (a * a + b * b - 2.0 * a * b * x),
        "cross": 0.5 * (a * b) ** 2 * (1.0 - x * x),
    }


LENGTHS = [(e, d) for e in (-0.01, -1e-3, 1e-4, 1.75e-3, 0.01) for d in (0.0, e, -e)]


@pytest.mark.parametrize(("e", "d"), LENGTHS)
def test_law_8_gives_the_peak_of_every_form(e: float, d: float) -> None:
    for alpha, gamma in ((128.0, 64.0), (20.0, 8.0)):
        peak = {form: lyon(lam, alpha / gamma, gamma)[0] for form, lam in stretched(np.zeros(1), e, d).items()}
        assert error_laws.dot_peak(alpha, gamma, e, d) == pytest.approx(peak["dot"], rel=1e-12)
        assert peak["difference"] == pytest.approx((1 - alpha / gamma * (e - d) ** 2 / 2) ** gamma, rel=1e-12)
        assert peak["cross"] == 1


def length_change(form: str, alpha: float, gamma: float, e: float, d: float) -> float:
    lam = grid(alpha)
    beta = alpha / gamma
    return float(
        np.abs(lyon(stretched(lam, e, d)[form], beta, gamma) - lyon(stretched(lam, 0, 0)[form], beta, gamma)).max()
    )


@pytest.mark.parametrize(("e", "d"), LENGTHS)
@pytest.mark.parametrize(("alpha", "gamma"), [(128.0, 64.0), (50.0, 16.0), (200.0, 32.0)])
def test_law_8_gives_the_change_of_every_form(alpha: float, gamma: float, e: float, d: float) -> None:
    expected = error_laws.difference_length_change(alpha, e, d)
    assert expected == pytest.approx(length_change("difference", alpha, gamma, e, d), rel=0.06)
    expected = error_laws.cross_length_change(alpha, e, d)
    assert expected == pytest.approx(length_change("cross", alpha, gamma, e, d), rel=0.06)
    if alpha * abs((1 + e) * (1 + d) - 1) <= 0.1:
        expected = error_laws.dot_length_change(alpha, e, d)
        assert expected == pytest.approx(length_change("dot", alpha, gamma, e, d), rel=0.05)


def test_law_8_reproduces_one_vector_one_percent_long() -> None:
    assert error_laws.dot_peak(128.0, 64.0, 0.01, 0.0) == pytest.approx(3.55, rel=1e-3)
    assert length_change("difference", 128.0, 64.0, 0.01, 0.0) == pytest.approx(0.0070, abs=5e-5)
    assert length_change("cross", 128.0, 64.0, 0.01, 0.0) == pytest.approx(0.0074, abs=5e-5)


@pytest.mark.parametrize("alpha", [20.0, 128.0, 1000.0])
def test_difference_beats_cross_up_to_the_crossover_of_one_vector(alpha: float) -> None:
    turn = float(error_laws.length_crossover(alpha))

    def advantage(e: float) -> float:
        return length_change("cross", alpha, 64.0, e, 0.0) - length_change("difference", alpha, 64.0, e, 0.0)

    assert advantage(0.9 * turn) > 0 > advantage(1.15 * turn)


def test_laws_take_arrays() -> None:
    alpha = np.array([[10.0], [50.0]])
    gamma = np.array([4.0, 8.0, 16.0])
    for law in (error_laws.lyon_taylor_dot, error_laws.lyon_taylor_cross):
        assert np.shape(law(alpha, gamma)) == (2, 3)
    assert np.shape(error_laws.difference_length_change(alpha, gamma / 1e3, 0.0)) == (2, 3)
