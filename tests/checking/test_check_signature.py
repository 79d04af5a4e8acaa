"""What `lag2fmu check --key` says of an FMU whose signature fits, does not fit, is missing or is none."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from lag2fmu.checking import check_fmu
from lag2fmu.cli import main
from lag2fmu.errors import LoadError

minisign = pytest.importorskip("minisign", reason="py-minisign is not installed")

pytestmark = pytest.mark.fmu


@pytest.fixture
def pair() -> minisign.KeyPair:
    return minisign.KeyPair.generate()


@pytest.fixture
def signed(exported, pair: minisign.KeyPair, tmp_path: Path) -> Path:
    """An FMU that the secret key of ``pair`` signed, with the public one in maker.pub beside it."""
    path = tmp_path / "pendulum.fmu"
    path.write_bytes(exported("pendulum").path.read_bytes())
    signature = pair.secret_key.sign(path.read_bytes(), trusted_comment="pendulum, version 1")
    (tmp_path / "pendulum.fmu.minisig").write_bytes(bytes(signature))
    (tmp_path / "maker.pub").write_bytes(bytes(pair.public_key))
    return path


def _checked(path: Path, key: str, *more: str) -> tuple[int, str]:
    done = CliRunner().invoke(main, ["check", str(path), "--key", key, *more])
    return done.exit_code, " ".join(done.output.split())


def test_a_signature_fits_by_file_and_by_text(signed: Path, pair: minisign.KeyPair) -> None:
    for key in (str(signed.parent / "maker.pub"), pair.public_key.to_base64().decode()):
        status, told = _checked(signed, key, "--no-run")
        assert status == 0
        assert "signed by the key given: pendulum, version 1" in told
    assert "is there, but not compared" in check_fmu(signed, run=False).notes[0]


def test_one_more_byte_is_found_and_nothing_is_run(signed: Path) -> None:
    signed.write_bytes(signed.read_bytes() + b"\0")
    status, told = _checked(signed, str(signed.parent / "maker.pub"))
    assert status == 1
    assert "pendulum.fmu.minisig does not fit" in told
    assert "not run, because its signature does not say who made it" in told


def test_another_s_key_a_missing_signature_and_none(signed: Path) -> None:
    status, told = _checked(signed, minisign.KeyPair.generate().public_key.to_base64().decode())
    assert (status, "does not fit" in told) == (1, True)
    beside = signed.with_name("pendulum.fmu.minisig")
    for content in (b"", b"\xff", b"x\n" * 4):
        beside.write_bytes(content)
        status, told = _checked(signed, str(signed.parent / "maker.pub"))
        assert (status, "is no signature of minisign" in told) == (1, True)
    beside.unlink()
    status, told = _checked(signed, str(signed.parent / "maker.pub"))
    assert (status, "is missing, so nothing says who made the FMU" in told) == (1, True)


@pytest.mark.parametrize("key", ["", "no_such.pub", "RWQ", "x" * 5000, "\0", "ä"])
def test_what_is_no_key_is_bad_input(key: str, signed: Path) -> None:
    status, told = _checked(signed, key)
    assert status == 2
    assert "is no public key of minisign, nor a file with one" in told


def test_without_the_package_a_sentence_says_which(signed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "minisign", None)
    with pytest.raises(LoadError, match=r"pip install \"lag2fmu\[signature\]\""):
        check_fmu(signed, key="RWQ")
