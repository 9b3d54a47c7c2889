"""The trials of a study in one SQLite file; each is on disk before the search continues."""

import json
import sqlite3
from collections.abc import Mapping
from pathlib import Path

from gait_lab.tune.evaluation import Trial
from gait_lab.tune.protocols import Measures
from robot_core.errors import NaoGaitError

FILE = "study.db"
_TABLES = """
CREATE TABLE IF NOT EXISTS about (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS trial (
    number INTEGER PRIMARY KEY, point TEXT NOT NULL, score REAL NOT NULL,
    measures TEXT NOT NULL, seconds REAL NOT NULL, error TEXT,
    ended TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now'))
);
"""


class Store:
    """The database of a study; open it with `create` or `reopen`.

    Args:
        path: The database file.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._db = sqlite3.connect(path, isolation_level=None)  # every statement commits
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=FULL")
            self._db.executescript(_TABLES)
        except sqlite3.Error as error:
            raise NaoGaitError("study database", str(path), f"a readable one ({error})") from error

    @classmethod
    def create(cls, out: Path, about: Mapping[str, str]) -> "Store":
        """Create the database in a folder; NaoGaitError if the folder holds a study."""
        path = out / FILE
        if path.exists():
            raise NaoGaitError("out", str(out), "a folder without a study; or --resume this one")
        out.mkdir(parents=True, exist_ok=True)
        store = cls(path)
        store._db.execute("BEGIN")
        store._db.executemany("INSERT INTO about VALUES (?, ?)", about.items())
        store._db.execute("COMMIT")
        return store

    @classmethod
    def reopen(cls, out: Path) -> "Store":
        """Open the database of a folder; NaoGaitError if there is none."""
        path = out / FILE
        if not path.is_file():
            raise NaoGaitError("out", str(out), f"a folder with a {FILE} to resume")
        return cls(path)

    @property
    def about(self) -> dict[str, str]:
        """The properties of the study, as stored at its creation."""
        return dict(self._db.execute("SELECT key, value FROM about"))

    def add(self, trial: Trial) -> None:
        """Add a trial; it is on disk when this returns."""
        measures = [[m.robot, dict(m.values), m.fell, m.excess] for m in trial.measures]
        self._db.execute(
            "INSERT INTO trial (number, point, score, measures, seconds, error)"
            " VALUES (?, ?, ?, ?, ?, ?)",
            (trial.number, json.dumps(trial.point), trial.score, json.dumps(measures),
             trial.seconds, trial.error),
        )  # fmt: skip

    def trials(self) -> list[Trial]:
        """Return all completed trials by number."""
        rows = self._db.execute(
            "SELECT number, point, score, measures, seconds, error FROM trial ORDER BY number"
        )
        return [
            Trial(
                number,
                tuple(json.loads(point)),
                score,
                tuple(Measures(*each) for each in json.loads(measures)),
                seconds,
                error,
            )
            for number, point, score, measures, seconds, error in rows
        ]

    def close(self) -> None:
        """Close the database."""
        self._db.close()
