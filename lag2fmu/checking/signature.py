"""The detached signature of a file against the public key of who should have made it.

Source: https://jedisct1.github.io/minisign, "Signature format": Ed25519 over the file or its BLAKE2b hash.
"""

from __future__ import annotations

from pathlib import Path

from lag2fmu.checking.findings import Finding
from lag2fmu.errors import LoadError

SUFFIX = ".minisig"
_RULE = "signature"
_REMEDY = "do not use the FMU; get it, its signature or the key again from who made it"


def signature_findings(path: Path, key: str | None) -> tuple[list[Finding], list[str]]:
    """What is wrong with the signature of ``path`` in the file beside it, its name with ``SUFFIX``, and a note on it.

    ``key``: the public key, as text in base64 or as the path of its file; None: nothing is compared. Raises LoadError
    for what is no key, and without the package that compares.
    """
    beside = path.with_name(path.name + SUFFIX)
    if key is None:
        return [], [f"{beside.name} is there, but not compared: give the key of its maker"] if beside.is_file() else []
    try:
        from minisign import PublicKey, Signature, VerifyError
    except ImportError as error:
        raise LoadError("signatures need a package; run 'pip install \"lag2fmu[signature]\"'") from error
    try:
        maker = PublicKey.from_file(key) if Path(key).is_file() else PublicKey.from_base64(key)
    except (ValueError, OSError) as error:
        raise LoadError(f"'{key}' is no public key of minisign, nor a file with one: {error}") from error
    try:
        signature = Signature.from_file(beside)
        maker.verify_file(path, signature)
    except FileNotFoundError:
        return [Finding(_RULE, beside.name, "is missing, so nothing says who made the FMU", _REMEDY)], []
    except VerifyError as error:
        return [Finding(_RULE, path.name, f"{beside.name} does not fit: {error}", _REMEDY)], []
    except (ValueError, OSError) as error:
        return [Finding(_RULE, beside.name, f"is no signature of minisign: {error}", _REMEDY)], []
    return [], [f"signed by the key given: {signature.trusted_comment}"]
