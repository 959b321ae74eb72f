"""Certificates: the exact flow enclosed in balls, with a proof of its sequence of modes, or a refusal by name."""

from asympk.certify.certificates import Certificate, certify, cover

__all__ = ["Certificate", "certify", "cover"]
