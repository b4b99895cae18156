"""``hubside users``: who may log in. Works on the data folder while no server does."""

from __future__ import annotations

import argparse
import asyncio
import getpass
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Final

from app.cli.output import Output
from app.errors import UsageError
from app.model.roles import Role
from app.service.office.audit import AuditLog
from app.service.office.users import Users
from app.store.store import Store
from app.store.user_rows import User

ROLES: Final = tuple(role.value for role in Role)
Run = Callable[[argparse.Namespace, Output, Users], Awaitable[None]]


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    parser = commands.add_parser("users", help="who may log in to the page, and in which role")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")

    def action(name: str, run: Run, text: str, named: bool = True) -> argparse.ArgumentParser:
        one = actions.add_parser(name, help=text)
        if named:
            one.add_argument("name")
        one.set_defaults(run=lambda arguments, output: asyncio.run(_with_users(arguments, output, run)))
        return one

    action("list", _list, "all users", named=False)
    add = action("add", _add, "add a user; the password is asked for, or read from stdin")
    add.add_argument("--role", choices=ROLES, default=Role.TECHNICIAN.value, help="the first user is always an expert")
    role = action("role", _role, "give a user another role")
    role.add_argument("role", choices=ROLES)
    action("password", _password, "set a user's password; it is asked for, or read from stdin")
    action("disable", _disable, "shut a user out; the name stays in the audit log")
    action("enable", _enable, "let a user in again")


@asynccontextmanager
async def opened(arguments: argparse.Namespace) -> AsyncIterator[tuple[Store, AuditLog]]:
    """The store of the data folder with its audit log. Raises StoreInUseError while a server has it, StoreError."""
    store = Store.open(arguments.settings.data)
    try:
        audit = AuditLog(store)
        yield store, audit
        await audit.close()
    finally:
        store.close()


async def _with_users(arguments: argparse.Namespace, output: Output, run: Run) -> int:
    async with opened(arguments) as (store, audit):
        await run(arguments, output, Users(store, audit))
    return 0


async def _list(_arguments: argparse.Namespace, output: Output, users: Users) -> None:
    if output.as_json:
        output.result([_as_dict(user) for user in users.all], "")
        return
    rows = [(user.name, output.texts(user.role.text_key), _state(output, user)) for user in users.all]
    output.table(("NAME", "ROLE", "STATE"), rows)


async def _add(arguments: argparse.Namespace, output: Output, users: Users) -> None:
    first = not users
    password = read_password(output)
    user = await users.add(arguments.name, password, Role(arguments.role), arguments.settings.person)
    _tell(output, user)
    if first:
        output.say("cli.user_first")


async def _role(arguments: argparse.Namespace, output: Output, users: Users) -> None:
    _tell(output, await users.set_role(arguments.name, Role(arguments.role), arguments.settings.person))


async def _password(arguments: argparse.Namespace, output: Output, users: Users) -> None:
    user = users.require(arguments.name)
    _tell(output, await users.set_password(user.id, read_password(output), arguments.settings.person))


async def _disable(arguments: argparse.Namespace, output: Output, users: Users) -> None:
    _tell(output, await users.set_disabled(arguments.name, True, arguments.settings.person))


async def _enable(arguments: argparse.Namespace, output: Output, users: Users) -> None:
    _tell(output, await users.set_disabled(arguments.name, False, arguments.settings.person))


def read_password(output: Output) -> str:
    """Asked for twice without echo on a terminal, else the first line of stdin. Never an argument: others see those.

    Raises UsageError.
    """
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\r\n")
    password = getpass.getpass(output.texts("cli.password"))
    if getpass.getpass(output.texts("cli.password_again")) != password:
        raise UsageError(reason="the two passwords differ")
    return password


def _tell(output: Output, user: User) -> None:
    text = output.texts(
        "cli.user_saved",
        name=user.name,
        role=output.texts(user.role.text_key),
        disabled=output.texts("cli.user_disabled") if user.disabled else "",
    )
    output.result(_as_dict(user), text)


def _state(output: Output, user: User) -> str:
    return output.texts("cli.user_shut_out" if user.disabled else "cli.user_active")


def _as_dict(user: User) -> dict[str, object]:
    return {"id": user.id, "name": user.name, "role": user.role.value, "disabled": user.disabled}
