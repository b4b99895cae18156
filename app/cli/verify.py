"""``hubside verify``: is the record of a restore whole, and by which key was it sealed? Needs no server, no device."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Final

from app.cli.output import Output
from app.errors import UsageError
from app.service.records.check import MAX_BYTES, Checked, Remade, Verdict, check_file
from app.service.records.signing import PublicKey, SigningKey, parse_public_key, public_key_of
from app.service.records.view import visible

UNVERIFIED: Final = 6
NO_RECORD: Final = 2
_DIGITS: Final = 32


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("verify", help="check the record of a restore: HTML, PDF or JSON")
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    parser.add_argument(
        "--key", action="append", default=[], metavar="FILE|FINGERPRINT", help="a key that is known besides our own"
    )
    parser.add_argument("--known", type=Path, metavar="FOLDER", help="a folder with keys that were handed out")
    parser.add_argument("--public-key", action="store_true", help="print our own key, to hand out")
    parser.set_defaults(run=_run)


def _run(arguments: argparse.Namespace, output: Output) -> int:
    if arguments.public_key:
        if arguments.files:
            raise UsageError(reason="--public-key prints our key and takes no files")
        return _print_key(arguments.settings.data, output)
    if not arguments.files:
        raise UsageError(reason="name the files to verify, or ask for --public-key")
    keys = _Keys.of(arguments, output)
    worst = {_verify(path, keys, output) for path in arguments.files}
    return next((code for code in (UNVERIFIED, NO_RECORD) if code in worst), 0)


def _print_key(folder: Path, output: Output) -> int:
    key = SigningKey.of(folder).public
    data = {"key": key.text, "fingerprint": key.fingerprint}
    output.result(data, key.text)
    if not output.as_json:
        output.say("cli.verify_fingerprint", fingerprint=key.fingerprint)
    return 0


class _Keys:
    """The keys that are known: those of files by what they are, others by their fingerprint alone."""

    def __init__(self, whole: dict[PublicKey, str], prints: frozenset[str]) -> None:
        self.whole = whole
        self._prints = prints

    @classmethod
    def of(cls, arguments: argparse.Namespace, output: Output) -> _Keys:
        """Our own, and those that the command names. Raises UsageError, SigningKeyError."""
        whole: dict[PublicKey, str] = {}
        if arguments.known is not None:
            whole |= _folder_keys(arguments.known)
        prints = set()
        for text in arguments.key:
            if digits := _fingerprint(text):
                prints.add(digits)
            else:
                whole[_file_key(Path(text))] = Path(text).name
        own = public_key_of(arguments.settings.data)
        if own is not None:
            whole[own] = output.texts("cli.verify_own")
        return cls(whole, frozenset(prints))

    def with_print(self, key: PublicKey, output: Output) -> dict[PublicKey, str]:
        """The known keys, and this one where its fingerprint was named."""
        if key in self.whole or _fingerprint(key.fingerprint) not in self._prints:
            return self.whole
        return self.whole | {key: output.texts("cli.verify_named")}


def _fingerprint(text: str) -> str:
    """Its digits; empty where the text is none. Blanks and colons between groups do not count."""
    digits = text.replace(" ", "").replace(":", "").lower()
    return digits if len(digits) == _DIGITS and set(digits) <= set("0123456789abcdef") else ""


def _file_key(path: Path) -> PublicKey:
    key = parse_public_key(path.read_text(encoding="utf-8", errors="replace")[:1000])
    if key is None:
        raise UsageError(reason=f"{path} holds no key; 'hubside verify --public-key' prints one")
    return key


def _folder_keys(folder: Path) -> dict[PublicKey, str]:
    """Keys of the files in a folder; other files may lie there too."""
    if not folder.is_dir():
        raise UsageError(reason=f"{folder} is no folder")
    texts = {path.name: path.read_text(encoding="utf-8", errors="replace")[:1000] for path in _files(folder)}
    found = {name: parse_public_key(text) for name, text in texts.items()}
    keys = {key: name for name, key in found.items() if key is not None}
    if not keys:
        raise UsageError(reason=f"{folder} holds no key; 'hubside verify --public-key' prints one")
    return keys


def _files(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.iterdir()) if path.is_file()]


def _verify(path: Path, keys: _Keys, output: Output) -> int:
    with path.open("rb") as file:
        data = file.read(MAX_BYTES + 1)
    checked = check_file(data, keys.whole)
    if checked.verdict is Verdict.UNKNOWN_KEY and checked.key is not None:
        # Named by its fingerprint only: it is known once it is seen.
        known = keys.with_print(checked.key, output)
        checked = checked if checked.key not in known else check_file(data, known)
    _tell(path, checked, output)
    if checked.verdict is Verdict.GOOD:
        return 0
    return NO_RECORD if checked.verdict is Verdict.NO_RECORD else UNVERIFIED


def _tell(path: Path, checked: Checked, output: Output) -> None:
    if output.as_json:
        output.result(_as_dict(path, checked), "")
        return
    reason = f" ({visible(checked.reason)})" if checked.reason else ""
    output.line(f"{path}: {output.texts(checked.verdict.text_key)}{reason}")
    if checked.key is not None:
        owner = f" – {checked.owner}" if checked.owner else ""
        output.line("  " + output.texts("cli.verify_key", fingerprint=checked.key.fingerprint, owner=owner))
    if checked.remade is not Remade.NOTHING:
        output.line("  " + output.texts(checked.remade.text_key))
    record = checked.record
    if record is not None:
        said = {"person": record.person, "time": record.ended, "station": record.station, "id": record.id}
        who = {
            name: visible(text).replace("\n", " ") for name, text in said.items()
        }  # it may hold what a terminal obeys
        output.line("  " + output.texts("cli.verify_who", **who))
        output.line("  " + output.texts(record.outcome.text_key))
        if record.simulated:
            output.line("  " + output.texts("record.twins"))


def _as_dict(path: Path, checked: Checked) -> dict[str, Any]:
    record = checked.record
    return {
        "file": str(path),
        "verdict": checked.verdict.value,
        "form": None if checked.form is None else checked.form.value,
        "fingerprint": None if checked.key is None else checked.key.fingerprint,
        "owner": checked.owner or None,
        "remade": checked.remade.value,
        "reason": checked.reason or None,
        "record": None
        if record is None
        else {
            "id": record.id,
            "station": record.station,
            "person": record.person,
            "started": record.started,
            "ended": record.ended,
            "outcome": record.outcome.value,
            "simulated": record.simulated,
        },
    }
