"""Commands by name, and the edge where an error becomes one sentence and an exit code."""

import os
import sys
import traceback
from collections.abc import Sequence

import typer

from jaxmotor._errors import JaxmotorError
from jaxmotor.cli._check import check_command
from jaxmotor.cli._demo import demo_command
from jaxmotor.cli._diagnose import diagnose_command
from jaxmotor.cli._encoder import encoder_command
from jaxmotor.cli._export import export_command
from jaxmotor.cli._fleet import fleet_command
from jaxmotor.cli._identify import identify_command
from jaxmotor.cli._import import import_command
from jaxmotor.cli._join import join_command
from jaxmotor.cli._record import record_command
from jaxmotor.cli._report import report_command
from jaxmotor.cli._simulate import simulate_command
from jaxmotor.cli._validate import validate_command

DONE, BAD_INPUT, BAD_USAGE, DEFECT, INTERRUPTED = 0, 1, 2, 3, 130


def build() -> typer.Typer:
    """The application with all its commands."""
    app = typer.Typer(
        name="jaxmotor",
        help="Identify DC motors from voltage and encoder counts.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    app.callback()(_options)
    app.command("demo")(demo_command)
    app.command("record")(record_command)
    app.command("import")(import_command)
    app.command("check")(check_command)
    app.command("join")(join_command)
    app.command("identify")(identify_command)
    app.command("diagnose")(diagnose_command)
    app.command("validate")(validate_command)
    app.command("report")(report_command)
    app.command("fleet")(fleet_command)
    app.command("simulate")(simulate_command)
    app.command("export")(export_command)
    app.command("encoder")(encoder_command)
    return app


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns 0 done, 1 bad input (a sentence), 2 wrong usage, 3 a defect of ours, 130 interrupted."""
    # JAX would take most of a GPU's memory that no command uses (`_precision.device`).
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    # As `keep_programs` does it; commands that need no JAX have products, too.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        build()(args=arguments, prog_name="jaxmotor")
    except SystemExit as end:
        if end.code == INTERRUPTED:
            return _interrupted()
        return end.code if isinstance(end.code, int) else BAD_USAGE if end.code else DONE
    except JaxmotorError as error:
        print(f"jaxmotor: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        # Whoever read our output has left; say nothing more, not even at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BAD_INPUT
    except MemoryError:
        print("jaxmotor: out of memory; split the recording, or close other programs", file=sys.stderr)
        return BAD_INPUT
    except Exception as error:
        if os.environ.get("JAXMOTOR_DEBUG"):
            traceback.print_exc()
        print(
            f"jaxmotor: a defect of jaxmotor, not of your input: {type(error).__name__}: {error}\n"
            "Please report it with the output of the same command under JAXMOTOR_DEBUG=1.",
            file=sys.stderr,
        )
        return DEFECT
    return DONE


def _options(
    version: bool = typer.Option(False, "--version", help="Print the version and exit.", is_eager=True),
) -> None:
    if version:
        import jaxmotor

        typer.echo(f"jaxmotor {jaxmotor.__version__}")
        raise typer.Exit


def _interrupted() -> int:
    print("jaxmotor: interrupted", file=sys.stderr)
    return INTERRUPTED
