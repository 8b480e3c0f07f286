"""The answers held against other engines, which know nothing of Polypod's equations.

`verify` compares along a motion, `verify_states` at given states; `integrate` applies the computed
forces over time. The engines are installed by `pip install polypod[verify]`.
"""

from polypod.verify.comparison import TOLERANCE, Comparison, Verification, verify, verify_states
from polypod.verify.engines import ENGINES
from polypod.verify.integrate import Integration, integrate
from polypod.verify.quantity_errors import Row

__all__ = [
    "ENGINES",
    "TOLERANCE",
    "Comparison",
    "Integration",
    "Row",
    "Verification",
    "integrate",
    "verify",
    "verify_states",
]
