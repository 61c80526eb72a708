"""A report verifies as it was written, and in no other state; a signature is that of one key."""

from __future__ import annotations

import random
import shutil
import subprocess
from pathlib import Path

import pytest
from commanding import Command

from gyrobench.workflow import manifest
from gyrobench.workflow.manifest import SigningError, VerificationError

FILES = ("run.json", "record.parquet", "channels.parquet", "result.json", "report.html", "report.pdf")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with files of the names of a report, of a suite: one test of it within."""
    made = random.Random(5)
    for name in (*FILES, "tumble/run.json", "tumble/result.json"):
        file = tmp_path / "r" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b'{"report_id": "0123456789"}' if file.suffix == ".json" else made.randbytes(200))
    manifest.write_manifest(tmp_path / "r" / "tumble")
    manifest.write_manifest(tmp_path / "r")
    return tmp_path / "r"


@pytest.fixture
def key(tmp_path: Path) -> Path:
    manifest.new_key(tmp_path / "laboratory.key")
    return tmp_path / "laboratory.key"


def test_every_file_of_the_report_is_covered_those_of_tests_within_too(folder: Path) -> None:
    (folder / "notes.txt").write_text("taken on Monday")
    (folder / "record.csv").write_text("1,2")  # of a report, written later
    found = manifest.verify(folder)
    assert set(found.files) == {*FILES, "tumble/run.json", "tumble/result.json", "tumble/manifest.json"}
    assert found.others == ["notes.txt", "record.csv"] and found.report_id == "0123456789" and not found.signed


@pytest.mark.long
def test_a_bit_changed_anywhere_is_found(folder: Path, key: Path) -> None:
    """1,000 flips over all files: those of the report, its manifest, the signature."""
    manifest.sign(folder, key)
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    draw = random.Random(11)
    for _ in range(1000):
        file = draw.choice(files)
        content = file.read_bytes()
        changed = bytearray(content)
        changed[draw.randrange(len(changed))] ^= 1 << draw.randrange(8)
        file.write_bytes(bytes(changed))
        with pytest.raises(VerificationError) as error:
            manifest.verify(folder, key.with_suffix(".pub"))
        assert file.name in str(error.value)
        file.write_bytes(content)
    assert manifest.verify(folder, key.with_suffix(".pub")).signed


def test_all_that_is_wrong_is_named(folder: Path) -> None:
    (folder / "report.pdf").unlink()
    (folder / "report.html").write_bytes(b"")
    with pytest.raises(VerificationError, match=r"report\.pdf: is missing\n.*report\.html: changed after"):
        manifest.verify(folder)


def test_who_rewrites_the_manifest_is_found_by_the_signature(folder: Path, key: Path, tmp_path: Path) -> None:
    manifest.sign(folder, key)
    kept = (folder / manifest.SIGNATURE).read_bytes()
    (folder / "report.pdf").write_bytes(b"another")
    with pytest.raises(VerificationError):
        manifest.sign(folder, key)  # nobody signs what does not verify
    manifest.write_manifest(folder)
    assert not manifest.verify(folder).signed
    with pytest.raises(VerificationError, match="nobody has signed"):
        manifest.verify(folder, key.with_suffix(".pub"))
    (folder / manifest.SIGNATURE).write_bytes(kept)
    with pytest.raises(VerificationError, match="not a signature of this report"):
        manifest.verify(folder, key.with_suffix(".pub"))
    other = manifest.new_key(tmp_path / "other.key")
    manifest.sign(folder, key)
    with pytest.raises(VerificationError, match=r"not a signature of this report by .*other\.pub"):
        manifest.verify(folder, other)


def test_a_report_written_again_as_it_was_keeps_its_signature(folder: Path, key: Path) -> None:
    manifest.sign(folder, key)
    manifest.write_manifest(folder)
    assert manifest.verify(folder, key.with_suffix(".pub")).signed


def test_keys(folder: Path, tmp_path: Path) -> None:
    locked = tmp_path / "locked.key"
    manifest.new_key(locked, "secret")
    assert locked.stat().st_mode & 0o077 == 0 and b"ENCRYPTED" in locked.read_bytes()
    manifest.sign(folder, locked, "secret")
    for wrong, said in ((None, "has a passphrase"), ("other", "passphrase is wrong")):
        with pytest.raises(SigningError, match=said):
            manifest.sign(folder, locked, wrong)
    with pytest.raises(SigningError, match="a key is not overwritten"):
        manifest.new_key(locked)
    with pytest.raises(SigningError, match=r"no public Ed25519 key in PEM; its public part is .*locked\.pub"):
        manifest.verify(folder, locked)
    with pytest.raises(SigningError, match="no private Ed25519 key"):
        manifest.sign(folder, locked.with_suffix(".pub"))


def test_a_key_with_a_passphrase_by_commands(folder: Path, gyrobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def prompt(text: str, **how: bool) -> str:
        asked.append((text, how["hide_input"], how["confirmation_prompt"]))
        return "secret"

    monkeypatch.setattr("typer.prompt", prompt)
    assert gyrobench("sign", "--new-key", "lab.key", "--passphrase")[0] == 0
    code, _, err = gyrobench("sign", folder, "--key", "lab.key")
    assert code == 2 and "lab.key: has a passphrase, which is needed\n--passphrase asks for it" in err
    assert gyrobench("sign", folder, "--key", "lab.key", "--passphrase")[0] == 0
    assert "signed by lab.pub" in gyrobench("verify", folder, "--key", "lab.pub")[1]
    assert asked == [("passphrase", True, True), ("passphrase", True, False)], "a new one twice, never shown"


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl here")
def test_openssl_makes_and_checks_the_same(folder: Path, tmp_path: Path) -> None:
    key, public = tmp_path / "o.key", tmp_path / "o.pub"
    subprocess.run(["openssl", "genpkey", "-algorithm", "ed25519", "-out", key], check=True)
    subprocess.run(["openssl", "pkey", "-in", key, "-pubout", "-out", public], check=True)
    signature = manifest.sign(folder, key)
    assert manifest.verify(folder, public).signed
    words = ["openssl", "pkeyutl", "-verify", "-pubin", "-inkey", public, "-rawin", "-in", folder / "manifest.json"]
    subprocess.run([*words, "-sigfile", signature], check=True)


def test_where_there_is_nothing_to_verify(tmp_path: Path) -> None:
    with pytest.raises(SigningError, match="no run is kept there"):
        manifest.verify(tmp_path)
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(SigningError, match=r"gyrobench report .* writes it anew"):
        manifest.verify(tmp_path)
