"""Findings of USD's own validators."""

from collections.abc import Iterator
from functools import cache
from typing import Any

from pxr import UsdValidation

from service.check.finding import Finding, Severity


def findings(stage: Any) -> Iterator[Finding]:
    """Yield errors and warnings of all validators of pxr."""
    for fault in UsdValidation.ValidationContext(_validators()).Validate(stage):
        warned = fault.GetType() == UsdValidation.ValidationErrorType.Warn
        severity: Severity = "warning" if warned else "error"
        code = f"usd:{fault.GetName()}"
        yield Finding(code, _place(fault), fault.GetMessage().strip(), severity)


@cache
def _validators() -> Any:
    return UsdValidation.ValidationRegistry().GetOrLoadAllValidators()


def _place(fault: Any) -> str:
    sites = [site for site in fault.GetSites() if site.IsPrim()]
    return str(sites[0].GetPrim().GetPath()) if sites else "/"
