"""The gateway's own certificate and the folder of trusted ones."""

from __future__ import annotations

import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from asyncua import ua
from asyncua.common.utils import ServiceError

from gateway.northbound.opcua.certificates import Own, Trust, check_uri
from tests.opcua.support import CLIENT_URI


def test_the_key_is_private(own: Own) -> None:
    assert stat.S_IMODE(own.key.stat().st_mode) == 0o600


def test_an_expired_certificate_is_refused(tmp_path: Path, own: Own) -> None:
    store = Trust(tmp_path)
    der = own.certificate.read_bytes()
    (tmp_path / "trusted" / "client.der").write_bytes(der)
    store.check(der, datetime.now(UTC))
    with pytest.raises(ServiceError) as refused:
        store.check(der, datetime.now(UTC) + timedelta(days=36500))
    assert refused.value.code == ua.StatusCodes.BadCertificateTimeInvalid
    with pytest.raises(ServiceError) as refused:
        store.check(b"no certificate", datetime.now(UTC))
    assert refused.value.code == ua.StatusCodes.BadCertificateInvalid


def test_strangers_cannot_fill_the_disk(tmp_path: Path, own: Own) -> None:
    store = Trust(tmp_path)
    for number in range(100):
        (tmp_path / "rejected" / f"{number}.der").touch()
    with pytest.raises(ServiceError):
        store.check(own.certificate.read_bytes(), datetime.now(UTC))
    assert len(list((tmp_path / "rejected").iterdir())) == 100


def test_an_existing_certificate_is_kept(tmp_path: Path) -> None:
    first = Own(tmp_path, CLIENT_URI, "localhost").certificate.read_bytes()
    assert Own(tmp_path, CLIENT_URI, "localhost").certificate.read_bytes() == first
    check_uri(first, CLIENT_URI)
