# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning one skill for one round of the curriculum; resumed where it was interrupted.

Segment after segment: whole episodes, a checkpoint, a judgement. The best checkpoint stays, the one
that the round began with included, since more training can destroy a good policy. A folder has::

    episodes/000.safetensors   what happened in each segment
    003.pt, best.pt            checkpoints: after all segments so far, and the best one
    rounds.json                the judgements of all rounds; written last, after each segment
    best/                      the best policy, as in a library
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slap_ros.acquisition.episodes import Episodes, load_episodes, save_episodes
from slap_ros.acquisition.groundings import Groundings
from slap_ros.acquisition.reward import SkillReward
from slap_ros.acquisition.settings import AcquisitionSettings
from slap_ros.acquisition.skill_env import Initiation, SkillMdp, SkillVecEnv
from slap_ros.acquisition.skill_library import AcquiredSkill, save_skill
from slap_ros.acquisition.validation import SkillTrials
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_json, read_text, write_whole
from slap_ros.learning.mlp_policy import MlpPolicy
from slap_ros.learning.work_folder import DECODING_ERRORS

if TYPE_CHECKING:
    from slap_ros.acquisition.sac import SkillLearner

ROUNDS = "rounds.json"
IN_A_ROW = 2  # good judgements after which a round is over


@dataclass(frozen=True)
class Round:
    """What became of a skill in one round.

    Args:
        initial: Success of what the round began with, from fresh states.
        segments: Success after each segment.
        best: After which segment it was highest; 0 for what the round began with.
        over: Whether the round is over.
    """

    initial: float
    segments: tuple[float, ...] = ()
    best: int = 0
    over: bool = False

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Round:
        """The inverse of ``asdict``, once it has been through JSON."""
        segments = tuple(map(float, data["segments"]))
        return cls(float(data["initial"]), segments, int(data["best"]), bool(data["over"]))

    @property
    def success(self) -> float:
        """The success of the checkpoint that stays."""
        return (self.initial, *self.segments)[self.best]

    def with_segment(self, success: float) -> Round:
        """With one more segment; of equally good ones the earlier stays."""
        segments = (*self.segments, success)
        better = success > self.success
        return replace(self, segments=segments, best=len(segments) if better else self.best)

    def good(self, enough: float) -> bool:
        """Whether the latest judgements are good."""
        latest = (self.initial, *self.segments)[-IN_A_ROW:]
        return len(latest) == IN_A_ROW and min(latest) >= enough


def rounds_in(folder: Path) -> list[Round]:
    """How a skill's rounds went so far; none before the first judgement.

    Args:
        folder: Of its training.

    Raises:
        InvalidParameterError: What is there is damaged.
    """
    path = folder / ROUNDS
    if not path.exists():
        return []
    try:
        return [Round.from_json(one) for one in parse_json(read_text(path))]
    except DECODING_ERRORS as error:
        raise InvalidParameterError(
            f"{path}: damaged: {error!r}; remove its folder to learn this skill again"
        ) from error


@dataclass
class SkillTraining:
    """The training of one skill, round after round in the same folder.

    Args:
        domain: Whose worlds are stepped.
        reward: Of the operator.
        horizon: Environment steps of an episode.
        settings: All hyper-parameters.
        seed: Of the whole curriculum.
        folder: Where everything is kept.
        attempt: How often the skill was learned from scratch before.
    """

    domain: Domain
    reward: SkillReward
    horizon: int
    settings: AcquisitionSettings
    seed: int
    folder: Path
    attempt: int = 0
    _rounds: list[Round] = field(default_factory=list, init=False)

    def run(
        self,
        number: int,
        initiations: Sequence[Initiation],
        fresh: Sequence[Initiation],
        beginning: MlpPolicy | None = None,
    ) -> Round:
        """One round; read where it is over, gone on with where it was interrupted.

        Args:
            number: Of the round, from 0; all before it are over.
            initiations: States that episodes begin in.
            fresh: States that checkpoints are judged from, of other tasks.
            beginning: The policy of another skill that the first round begins with.

        Returns:
            How it went; the folder has the best policy.

        Raises:
            InvalidParameterError: The folder is damaged.
        """
        if not (self.folder / ROUNDS).exists():
            shutil.rmtree(self.folder, ignore_errors=True)  # of a round that had hardly begun
        self._rounds = rounds_in(self.folder)
        if number < len(self._rounds) and self._rounds[number].over:
            return self._rounds[number]
        done = sum(len(earlier.segments) for earlier in self._rounds[: number + 1])
        groundings = Groundings(list(dict.fromkeys(one.grounding for one in initiations)))
        mdp = SkillMdp(self.domain, self.reward, groundings, self.settings.dense_share)
        in_round = 0 if number == len(self._rounds) else len(self._rounds[number].segments)
        learner = self._learner(mdp, initiations, number, in_round)
        trials = SkillTrials(self.domain, self.reward, fresh, self.horizon)
        self._resume(learner, number, done, beginning)
        if number == len(self._rounds):
            self._begin_round(learner, trials, done)
        while not self._rounds[-1].over:
            self._segment(learner, trials, done)
            done += 1
        return self._rounds[-1]

    def _learner(
        self, mdp: SkillMdp, initiations: Sequence[Initiation], number: int, segments: int
    ) -> SkillLearner:
        from slap_ros.acquisition.sac import SkillLearner  # torch, here alone

        seed = self._seed(number)
        first_round = segments * self.settings.segment_episodes
        environments = self.settings.sac.environments
        env = SkillVecEnv(mdp, initiations, environments, self.horizon, (seed,), first_round)
        return SkillLearner(env, self.settings.sac, seed)

    def _seed(self, number: int) -> int:
        """Every skill, attempt and round draws from streams of its own."""
        text = f"{self.seed} {self.reward.operator.name} {number}"
        if self.attempt:
            text += f" {self.attempt}"
        return int.from_bytes(sha256(text.encode()).digest()[:4], "little")

    def _resume(
        self,
        learner: SkillLearner,
        number: int,
        done: int,
        beginning: MlpPolicy | None,
    ) -> None:
        """Go on from the last checkpoint; a round begins with the best one where it is better.

        Args:
            learner: To go on with.
            number: Of the round.
            done: Segments so far, of all rounds.
            beginning: What a first round begins with.
        """
        types = self.domain.types_by_name
        earlier = [load_episodes(self._episodes(i), types) for i in range(done)]
        if done:
            # Where none has succeeded yet, the last one has learned most.
            previous = self._rounds[number - 1]
            begins = number == len(self._rounds)
            worse = begins and previous.segments[-1] < previous.success
            path = self.folder / "best.pt" if worse else self._checkpoint(done)
            learner.resume(path, earlier)
        elif beginning is not None:
            learner.begin_with(beginning)

    def _begin_round(self, learner: SkillLearner, trials: SkillTrials, done: int) -> None:
        if done:  # best.pt may be another one before the first segment counts
            learner.save(self._checkpoint(done))
        self._rounds.append(Round(trials.success(learner.policy().mean)))
        self._keep_best(learner)
        self._write_rounds()

    def _segment(self, learner: SkillLearner, trials: SkillTrials, number: int) -> None:
        episodes: Episodes = learner.learn(self.settings.segment_episodes)
        save_episodes(self._episodes(number), episodes)
        success = trials.success(learner.policy().mean)
        now = self._rounds[-1].with_segment(success)
        over = len(now.segments) == self.settings.segments(self.horizon)
        self._rounds[-1] = replace(now, over=over or now.good(self.settings.enough))
        learner.save(self._checkpoint(number + 1))
        if now.best == len(now.segments):
            self._keep_best(learner)
        self._write_rounds()  # until here the segment counts for nothing
        self._checkpoint(number).unlink(missing_ok=True)

    def _keep_best(self, learner: SkillLearner) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        learner.save(self.folder / "best.pt")
        operator, template = self.reward.operator, self.reward.template
        skill = AcquiredSkill(operator, template, learner.policy(), self.horizon)
        save_skill(self.folder / skill.folder_name, skill)

    def _checkpoint(self, segments: int) -> Path:
        return self.folder / f"{segments:03}.pt"

    def _episodes(self, number: int) -> Path:
        return self.folder / "episodes" / f"{number:03}.safetensors"

    def _write_rounds(self) -> None:
        data = [asdict(one) for one in self._rounds]
        write_whole(self.folder / ROUNDS, json.dumps(data))
