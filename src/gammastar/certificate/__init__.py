"""The certificate: what is known of a path and a speed before any flight."""

from gammastar.certificate.certificate import Certificate, Check, Verdict
from gammastar.certificate.certify import certify
from gammastar.certificate.feasible import feasible_profile
from gammastar.certificate.motion import Progress
from gammastar.certificate.speeds import Limits
from gammastar.path.sampling import Place

__all__ = ["Certificate", "Check", "Limits", "Place", "Progress", "Verdict", "certify", "feasible_profile"]
