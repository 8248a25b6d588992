"""Does the jobs of a study in the process that calls it."""

from pathlib import Path

from shoal.campaigns.draws import load_template
from shoal.campaigns.jobs.runner import Runner
from shoal.scenarios import ScenarioDocument


class StudyRunner(Runner):
    """Runs scenarios, also those that are inside a study or have distributions in place of values."""

    def load(self, path: Path) -> ScenarioDocument:
        """The draft of a scenario's file or of a study's."""
        return load_template(path, ScenarioDocument).draft

    def hint(self, path: Path) -> str:
        """Nothing: values may vary here."""
        return ""
