"""The manifest of a report: digests of all its files as they were written, in ``manifest.json``, which may be signed.

    gyrobench verify FOLDER [--key laboratory.pub]         every file of the report as it was written, by whom
    gyrobench sign FOLDER --key laboratory.key

The manifest tells a file that was changed by accident or by somebody who does not know of it; whoever rewrites file and
manifest is found out by the signature alone.  It is Ed25519 over the bytes of ``manifest.json``, raw in
``manifest.json.sig``, keys in PEM: OpenSSL makes and checks the same.  A signature says which key, not when.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench import reading
from gyrobench.errors import Advice, GyrobenchError
from gyrobench.files import sha256, write_whole
from gyrobench.record.run_document import FILE as RUN
from gyrobench.workflow.run_folders import MANIFEST, RECORD, REPORT, SIGNATURE

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

FORMAT = 1
COVERED = {*RECORD, *REPORT, MANIFEST, SIGNATURE}  # of the folders within, those of a suite, their manifests too


class VerificationError(GyrobenchError):
    """A report that is not as it was written, or not signed by the key."""

    exit_code = 1


class SigningError(GyrobenchError):
    """A report that cannot be signed or verified: no manifest, no package, a key of another kind."""


@dataclass(frozen=True)
class Verified:
    """A report as it was written: its files, others beside them, and whether a key has signed it."""

    files: list[str]
    others: list[str]
    signed: bool
    report_id: str


def write_manifest(folder: Path) -> Path:
    """Write the digests of the files of a report; the signature of another content is removed."""
    files = {name: sha256(folder / name) for name in _files(folder)[0]}
    path, content = folder / MANIFEST, _text({"format": FORMAT, "files": files})
    if not path.is_file() or path.read_bytes() != content:
        (folder / SIGNATURE).unlink(missing_ok=True)
        write_whole(path, content)
    return path


def verify(folder: Path, key: Path | None = None) -> Verified:
    """Return what is known of a report whose files are as they were written; key: public, of the signature.

    Raises VerificationError with every file that is not, SigningError where there is nothing to verify.
    """
    manifest = folder / MANIFEST
    if not manifest.is_file():
        what = f"gyrobench report {folder} writes it anew" if (folder / RUN).is_file() else "no run is kept there"
        raise SigningError(f"{folder}: no {MANIFEST}; {what}")
    data = reading.json_object(reading.read_text(manifest, VerificationError), manifest, VerificationError)
    content, has = reading.opened(data, manifest, VerificationError)
    files = content.get("files")
    if not has or manifest.read_bytes() != _text(content) or not isinstance(files, dict):
        raise VerificationError(f"{manifest}: changed after it was written")
    there, others = _files(folder)
    problems = [f"{name}: is missing" for name in files if name not in there]
    problems += [
        f"{n}: changed after the report was written" for n in there if n in files and sha256(folder / n) != files[n]
    ]
    if problems:
        raise VerificationError(
            f"{folder}: not the report that was written\n" + "\n".join(f"  - {p}" for p in problems)
        )
    if key is not None:
        _check_signature(folder, key)
    others += [name for name in there if name not in files]
    result = folder / "result.json"
    report_id = json.loads(result.read_text("utf-8")).get("report_id", "") if "result.json" in files else ""
    return Verified(list(files), others, key is not None, report_id)


def sign(folder: Path, key: Path, passphrase: str | None = None) -> Path:
    """Sign the manifest of a report that verifies; return the path of the signature.  Raises as :func:`verify`."""
    verify(folder)
    private = _private_key(key, passphrase)
    write_whole(folder / SIGNATURE, private.sign((folder / MANIFEST).read_bytes()))
    return folder / SIGNATURE


def new_key(path: Path, passphrase: str | None = None) -> Path:
    """Write a new key and beside it, with the suffix ``.pub``, its public part, which is returned."""
    ed25519, serialization = _cryptography()
    public = path.with_suffix(".pub")
    for file in (path, public):
        if file.exists():
            raise SigningError(f"{file}: exists; a key is not overwritten")
    made, s = ed25519.Ed25519PrivateKey.generate(), serialization
    secret = s.BestAvailableEncryption(passphrase.encode()) if passphrase else s.NoEncryption()
    path.touch(mode=0o600)
    path.write_bytes(made.private_bytes(s.Encoding.PEM, s.PrivateFormat.PKCS8, secret))
    public.write_bytes(made.public_key().public_bytes(s.Encoding.PEM, s.PublicFormat.SubjectPublicKeyInfo))
    return public


def _text(content: dict[str, Any]) -> bytes:
    return (json.dumps(reading.sealed(content), indent=1, ensure_ascii=False) + "\n").encode()


def _files(folder: Path) -> tuple[list[str], list[str]]:
    """Return the files of a report by their path in its folder, and the others there."""
    found = sorted(p.relative_to(folder) for p in folder.rglob("*") if p.is_file())
    own = [p.as_posix() for p in found if p.name in COVERED and p.as_posix() not in (MANIFEST, SIGNATURE)]
    others = [p.as_posix() for p in found if p.name not in COVERED]
    return own, others


def _check_signature(folder: Path, key: Path) -> None:
    from cryptography.exceptions import InvalidSignature

    ed25519, serialization = _cryptography()
    try:
        public = serialization.load_pem_public_key(key.read_bytes())
    except ValueError:
        public = None
    if not isinstance(public, ed25519.Ed25519PublicKey):
        part = key.with_suffix(".pub")
        way = f"its public part is {part}" if part != key and part.is_file() else "gyrobench sign --new-key makes one"
        raise SigningError(f"{key}: no public Ed25519 key in PEM; {way}")
    try:
        signature = (folder / SIGNATURE).read_bytes()
    except FileNotFoundError:
        raise VerificationError(f"{folder}: the files are as they were written, but nobody has signed them") from None
    try:
        public.verify(signature, (folder / MANIFEST).read_bytes())
    except InvalidSignature:
        raise VerificationError(f"{folder / SIGNATURE}: not a signature of this report by {key}") from None


def _private_key(key: Path, passphrase: str | None) -> Ed25519PrivateKey:
    ed25519, serialization = _cryptography()
    try:
        private: Any = serialization.load_pem_private_key(key.read_bytes(), passphrase.encode() if passphrase else None)
    except TypeError:
        if passphrase is None:
            asking = Advice("sign", "--passphrase asks for it")
            raise SigningError(f"{key}: has a passphrase, which is needed").advised(asking) from None
        raise SigningError(f"{key}: has no passphrase") from None
    except ValueError:
        private = None
    if not isinstance(private, ed25519.Ed25519PrivateKey):
        raise SigningError(f"{key}: no private Ed25519 key in PEM, or the passphrase is wrong")
    found: Ed25519PrivateKey = private
    return found


def _cryptography() -> tuple[Any, Any]:
    try:
        from cryptography.hazmat.primitives import serialization
        from cryptography.hazmat.primitives.asymmetric import ed25519
    except ImportError:
        raise SigningError("signatures need a further package: pip install 'gyrobench[sign]'") from None
    return ed25519, serialization
