"""How often fleets of good motors have one named that does not belong, and how often one that is astray is found.

Motors are normal in all parameters; the astray one lies that many standard deviations from the mean in the first.
"""

import argparse

import numpy as np

from jaxmotor.fleet import Population
from jaxmotor.fleet._population import population_of

SIZES = ((8, 1), (12, 2), (15, 3), (20, 2), (20, 4), (50, 2), (50, 4), (200, 2), (200, 4))
ERROR = 1e-5


def fleet(motors: int, parameters: int, seed: int, astray: float) -> Population:
    rng = np.random.default_rng((motors, parameters, seed))
    estimates = rng.normal(size=(motors, parameters))
    if astray:
        estimates[0] = np.eye(parameters)[0] * astray
    errors = np.broadcast_to(ERROR**2 * np.eye(parameters), (motors, parameters, parameters))
    names = tuple(f"parameter {k}" for k in range(parameters))
    return population_of(names, (False,) * parameters, tuple(map(str, range(motors))), estimates, errors)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fleets", type=int, default=800)
    given = parser.parse_args()
    print("motors  parameters  fleets with a good one named  good ones named  threshold sd  6 sd found  8 sd found")
    for motors, parameters in SIZES:
        good = [fleet(motors, parameters, seed, 0.0) for seed in range(given.fleets)]
        fleets = np.mean([len(found.outliers) > 0 for found in good])
        each = np.mean([len(found.outliers) for found in good]) / motors
        threshold = np.median([found.threshold for found in good])
        shares = []
        for astray in (6.0, 8.0):
            runs = (fleet(motors, parameters, seed, astray) for seed in range(given.fleets // 2))
            shares.append(np.mean(["0" in {outlier.motor for outlier in found.outliers} for found in runs]))
        print(f"{motors:6d} {parameters:11d} {100 * fleets:27.1f} % {1e3 * each:11.2f} in 1000", end=" ")
        print(f"{threshold:11.2f} {100 * shares[0]:11.1f} % {100 * shares[1]:9.1f} %", flush=True)


if __name__ == "__main__":
    main()
