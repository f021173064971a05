"""The gateway's own certificate, and which clients' certificates it trusts.

A folder: ``own/certificate.der`` and ``own/key.pem``, made at the first start; ``trusted/`` holds the
clients that may come in; ``rejected/`` those that tried, for the operator to move. The folder is read at
each new channel, so that moving a file is enough.
"""

from __future__ import annotations

import hashlib
import ipaddress
import os
import socket
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import structlog
from asyncua import ua
from asyncua.common.utils import ServiceError
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

_log = structlog.get_logger(__name__)

KEY_BITS = 2048
VALID_DAYS = 3650
REJECTED_KEPT = 100
"""Rejected certificates kept at most, so that strangers cannot fill the disk."""


class Own:
    """The certificate and key in ``folder/own``, made anew if missing."""

    def __init__(self, folder: Path, uri: str, host: str) -> None:
        self.certificate = folder / "own" / "certificate.der"
        self.key = folder / "own" / "key.pem"
        if not (self.certificate.exists() and self.key.exists()):
            self._make(uri, host)

    def _make(self, uri: str, host: str) -> None:
        self.key.parent.mkdir(parents=True, exist_ok=True)
        key = rsa.generate_private_key(public_exponent=65537, key_size=KEY_BITS)
        _write_secret(self.key, _pem(key))
        self.certificate.write_bytes(_self_signed(key, uri, host).public_bytes(serialization.Encoding.DER))
        _log.info("own certificate made", path=str(self.certificate), uri=uri)


class Trust:
    """Decides on clients' certificates. Only those put into ``trusted`` by hand are taken."""

    def __init__(self, folder: Path) -> None:
        self._trusted = folder / "trusted"
        self._rejected = folder / "rejected"
        for path in (self._trusted, self._rejected):
            path.mkdir(parents=True, exist_ok=True)

    def check(self, der: bytes, now: datetime) -> None:
        """Let the certificate pass, or keep it in ``rejected``.

        Raises:
            ServiceError: BadCertificateInvalid, BadCertificateTimeInvalid or BadCertificateUntrusted.
        """
        certificate = _parse(der)
        if der not in _certificates(self._trusted):
            self._reject(der, certificate)
            raise ServiceError(ua.StatusCodes.BadCertificateUntrusted)
        if not certificate.not_valid_before_utc <= now <= certificate.not_valid_after_utc:
            raise ServiceError(ua.StatusCodes.BadCertificateTimeInvalid)

    def _reject(self, der: bytes, certificate: x509.Certificate) -> None:
        path = self._rejected / f"{hashlib.sha1(der).hexdigest()}.der"  # the thumbprint clients show
        subject = certificate.subject.rfc4514_string()
        _log.warning("client certificate not trusted", subject=subject, file=str(path))
        if not path.exists() and len(list(self._rejected.iterdir())) < REJECTED_KEPT:
            path.write_bytes(der)


def check_uri(der: bytes, uri: str | None) -> None:
    """The certificate must name the ApplicationUri that the client claims (OPC 10000-4 section 6.1.3).

    Raises:
        ServiceError: BadCertificateUriInvalid.
    """
    try:
        names = _parse(der).extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        known = names.get_values_for_type(x509.UniformResourceIdentifier)
    except x509.ExtensionNotFound:
        known = []
    if uri not in known:
        raise ServiceError(ua.StatusCodes.BadCertificateUriInvalid)


def _parse(der: bytes) -> x509.Certificate:
    try:
        return x509.load_der_x509_certificate(der)
    except ValueError as error:
        raise ServiceError(ua.StatusCodes.BadCertificateInvalid) from error


def _certificates(folder: Path) -> Iterator[bytes]:
    """The certificates in a folder as DER; files that hold none are passed over."""
    for path in sorted(folder.iterdir()):
        data = path.read_bytes()
        try:
            pem = data.startswith(b"-----BEGIN")
            load = x509.load_pem_x509_certificate if pem else x509.load_der_x509_certificate
            yield load(data).public_bytes(serialization.Encoding.DER)
        except ValueError:
            _log.warning("not a certificate", file=str(path))


def _pem(key: rsa.RSAPrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )


def _write_secret(path: Path, data: bytes) -> None:
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
        file.write(data)


def _self_signed(key: rsa.RSAPrivateKey, uri: str, host: str) -> x509.Certificate:
    """An application instance certificate (OPC 10000-6 section 6.2.2)."""
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, uri[:64])])
    now = datetime.now(UTC)
    usages = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    return (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(hours=1))  # clocks of clients differ
        .not_valid_after(now + timedelta(days=VALID_DAYS))
        .add_extension(x509.SubjectAlternativeName(_names(uri, host)), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_KEY_USAGE, critical=True)
        .add_extension(x509.ExtendedKeyUsage(usages), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )


_KEY_USAGE = x509.KeyUsage(
    digital_signature=True,
    content_commitment=True,
    key_encipherment=True,
    data_encipherment=True,
    key_agreement=False,
    key_cert_sign=True,  # it signs itself; some clients insist
    crl_sign=False,
    encipher_only=False,
    decipher_only=False,
)


def _names(uri: str, host: str) -> list[x509.GeneralName]:
    names: list[x509.GeneralName] = [x509.UniformResourceIdentifier(uri)]
    for known in dict.fromkeys((host, socket.gethostname(), "localhost")):
        try:
            names.append(x509.IPAddress(ipaddress.ip_address(known)))
        except ValueError:
            names.append(x509.DNSName(known))
    return names
