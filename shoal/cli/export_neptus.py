"""`shoal export neptus`: writes the files that make a vehicle known to Neptus."""

from pathlib import Path

import click

from runtime.kernel import WallClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.cli.completion import complete_profile
from shoal.cli.options import add_user_task_folders, code_option, config_dir_option, modes_option, overrides_option
from shoal.neptus import parameter_list, unplannable_maneuvers, vehicle_definition
from support.atomic_files import new_file
from support.diagnostics import ProfileError
from support.terminal_text import printable


@click.command()
@click.argument("profile", shell_complete=complete_profile)
@click.option(
    "--out",
    default="neptus",
    show_default=True,
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder to write to; with that of Neptus itself, the files are where it looks for them.",
)
@config_dir_option
@modes_option
@click.option("-V", "--vehicle", default="", help="Another name for the vehicle.")
@overrides_option
@code_option
def neptus(
    profile: str,
    out: Path,
    config_dir: tuple[Path, ...],
    profiles: tuple[str, ...],
    vehicle: str,
    overrides: tuple[str, ...],
    code: tuple[Path, ...],
) -> None:
    """Write the definition of the vehicle of PROFILE (.nvcl) and the list of its parameters for Neptus.

    The parameters are those of the tasks that -p enables, by default Simulation, with saved values.
    """
    add_user_task_folders(code, [profile])
    try:
        loaded = load_profile(profile, config_dir, vehicle=vehicle, saved=Path("db"), overrides=overrides)
        made = build(loaded, loaded.parse_modes(profiles or "Simulation"), clock=WallClock(), skip_missing_extras=True)
    except ProfileError as error:
        raise click.ClickException(str(error)) from None
    name = made.vehicle.name
    contents = {
        out / "vehicles-defs" / f"{name}.nvcl": vehicle_definition(made.vehicle),
        out / "conf" / "params" / f"{name}.en_US.xml": parameter_list(made.vehicle),
    }
    missing = unplannable_maneuvers(made.vehicle)
    made.vehicle.close()
    for path, content in contents.items():
        others = [other for other in path.parent.glob(f"*-{name}.nvcl") if other.name.split("-", 1)[0].isdigit()]
        if path.suffix == ".nvcl" and others:
            click.echo(printable(f"kept {others[0]}, which defines {name} already"))
            continue
        with new_file(path, force=True) as part:
            part.write_bytes(content)
        click.echo(printable(f"wrote {path}"))
    for reason, sections in made.skipped.items():
        click.echo(printable(f"without {', '.join(sections)} ({reason})"), err=True)
    if missing:
        click.echo(f"Neptus cannot plan {', '.join(missing)}", err=True)
