"""What every calibration.json holds."""

from typing import Any

import numpy as np

from rotorjax.calibration.calibration_file import MODEL_VERSION
from rotorjax.calibration.fit import Fit


def fit_entry(fit: Fit, name: str, printed_rms: float) -> dict[str, Any]:
    """The keys that both calibrations share; name: of the parameter set."""
    return {
        "set": name,
        "model_version": MODEL_VERSION,
        "parameters": fit.parameters.table(fit.values),
        "printed": fit.parameters.table(fit.parameters.printed),
        "standard_deviations": fit.parameters.table(np.asarray(fit.deviations)),
        "covariance": fit.covariance,
        "rms_error": fit.rms,
        "rms_error_printed_factor": printed_rms,
        "converged": fit.converged,
        "why": fit.why,
        "at_bound": fit.at_bound,
        "method": fit.method,
        "steps": len(fit.history) - 1,
        "history": fit.history,
        "wall_time_s": fit.wall_time_s,
        "compile_time_s": fit.compile_time_s,
    }
