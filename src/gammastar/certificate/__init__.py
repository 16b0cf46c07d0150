"""The certificate: what is known of a path and a speed before any flight."""

from gammastar.certificate.certificate import Certificate, Check, Verdict
from gammastar.certificate.certify import certify
from gammastar.certificate.motion import Progress
from gammastar.certificate.sampling import Place
from gammastar.certificate.speeds import Limits

__all__ = ["Certificate", "Check", "Limits", "Place", "Progress", "Verdict", "certify"]
