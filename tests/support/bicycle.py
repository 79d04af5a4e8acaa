"""Published numbers of the Whipple bicycle with the parameters of models/whipple_bicycle."""

from benchmarks.published_values import BICYCLE as EIGENVALUES

__all__ = ["EIGENVALUES"]
