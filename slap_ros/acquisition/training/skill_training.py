# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning one skill for one round of the curriculum; resumed where it was interrupted.

Segment after segment: whole episodes, a checkpoint, a judgement. The best checkpoint stays, the one
that the round began with included, since more training can destroy a good policy. While one is
judged, the next segment is learned, unless the round may be over then. A folder has::

    episodes/000.safetensors   what happened in each segment
    003.pt, best.pt            checkpoints: after all segments so far, and the best one
    rounds.json                the judgements of all rounds; written last, after each segment
    best/                      the best policy, as in a library
"""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slap_ros.acquisition.training.episodes import Episodes, load_episodes, save_episodes
from slap_ros.acquisition.training.judges import Judge
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.skill_env import Initiation, SkillMdp, SkillVecEnv
from slap_ros.core import Domain, MakeVectorWorld
from slap_ros.files import parse_json, read_text, write_whole
from slap_ros.learning.work_folder import DECODING_ERRORS, damaged
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.skills.groundings import Groundings
from slap_ros.skills.reward import SkillReward
from slap_ros.skills.skill_library import AcquiredSkill, save_skill

if TYPE_CHECKING:
    from slap_ros.acquisition.training.sac import SkillLearner

ROUNDS = "rounds.json"
IN_A_ROW = 2  # good judgements after which a round is over
ENOUGH_IN_A_ROW = 3  # judgements after which one is over that are as good as the goal needs


@dataclass(frozen=True)
class Round:
    """The judgements of a skill in one round.

    Args:
        initial: Success rate of what the round began with, from fresh states.
        segments: Success rate after each segment.
        best: Number of the segment after which success was highest; 0 for what the round began
            with.
        over: Whether the round is over.
    """

    initial: float
    segments: tuple[float, ...] = ()
    best: int = 0
    over: bool = False

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Round:
        """The round of ``asdict``, read from JSON."""
        segments = tuple(map(float, data["segments"]))
        return cls(float(data["initial"]), segments, int(data["best"]), bool(data["over"]))

    @property
    def success(self) -> float:
        """The success rate of the checkpoint that stays."""
        return (self.initial, *self.segments)[self.best]

    @property
    def newest_is_best(self) -> bool:
        """Whether the checkpoint that stays is the latest one."""
        return self.best == len(self.segments)

    def with_segment(self, success: float) -> Round:
        """The round with one more segment; of equally good checkpoints the earlier one stays."""
        segments = (*self.segments, success)
        better = success > self.success
        return replace(self, segments=segments, best=len(segments) if better else self.best)

    def good(self, enough: float, judgements: int) -> bool:
        """Whether so many of the latest judgements are good."""
        latest = (self.initial, *self.segments)[-judgements:]
        return len(latest) == judgements and min(latest) >= enough


def rounds_in(folder: Path) -> list[Round]:
    """The rounds of a skill so far; none before the first judgement.

    Args:
        folder: Folder of the skill's training.

    Raises:
        InvalidParameterError: What is there is damaged.
    """
    path = folder / ROUNDS
    if not path.exists():
        return []
    try:
        return [Round.from_json(one) for one in parse_json(read_text(path))]
    except DECODING_ERRORS as error:
        raise damaged(path, error, "remove its folder to learn this skill again") from error


def episodes_path(folder: Path, segment: int) -> Path:
    """The file with the episodes of a segment.

    Args:
        folder: Folder of the skill's training.
        segment: Number of the segment, from 0.
    """
    return folder / "episodes" / f"{segment:03}.safetensors"


@dataclass
class SkillTraining:
    """The training of one skill, round after round in the same folder.

    Args:
        domain: Domain of the worlds.
        reward: Reward of the operator's skill.
        horizon: Environment steps of an episode.
        settings: All hyper-parameters of the curriculum.
        seed: Seed of the whole curriculum.
        folder: Folder of the skill's training.
        make_worlds: Function that makes the domain's worlds that are learned in.
        attempt: Number of times that the skill was learned from scratch before.
        needed: Success rate that the goal needs; above 1 to go by the settings alone.
    """

    domain: Domain
    reward: SkillReward
    horizon: int
    settings: AcquisitionSettings
    seed: int
    folder: Path
    make_worlds: MakeVectorWorld
    attempt: int = 0
    needed: float = math.inf
    _rounds: list[Round] = field(default_factory=list, init=False)

    def run(
        self,
        number: int,
        initiations: Sequence[Initiation],
        judge: Judge,
        beginning: MlpPolicy | None = None,
    ) -> Round:
        """Carry out one round; read it where it is over, resume it where it was interrupted.

        Args:
            number: Number of the round, from 0; all before it are over.
            initiations: Initiation states, in which episodes begin.
            judge: Judge of checkpoints, from states of other tasks.
            beginning: Policy of another skill that the first round begins with; None for random
                weights.

        Returns:
            The round with its judgements; the folder has the best policy.

        Raises:
            ChildProcessError: A process that judged or stepped worlds has ended.
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
        begins = number == len(self._rounds)
        in_round = 0 if begins else len(self._rounds[number].segments)
        learner = self._learner(mdp, initiations, number, in_round, judge)
        self._resume(learner, number, done, beginning)
        ahead = self._judge(learner, judge, done, None) if begins else None
        while not self._rounds[-1].over:
            episodes = learner.learn(self.settings.segment_episodes) if ahead is None else ahead
            save_episodes(episodes_path(self.folder, done), episodes)
            done += 1
            ahead = self._judge(learner, judge, done, self._rounds[-1])
        return self._rounds[-1]

    def _learner(
        self,
        mdp: SkillMdp,
        initiations: Sequence[Initiation],
        number: int,
        segments: int,
        judge: Judge,
    ) -> SkillLearner:
        from slap_ros.acquisition.training.sac import SkillLearner  # torch, here alone

        seed = self._seed(number)
        first_round = segments * self.settings.segment_episodes
        environments = self.settings.sac.n_envs
        env = SkillVecEnv(
            mdp, initiations, environments, self.horizon, (seed,), first_round, self.make_worlds
        )
        return SkillLearner(env, self.settings.sac, seed, judge.core_to_spare)

    def _seed(self, number: int) -> int:
        """The seed of a round: every skill, attempt and round draws from a stream of its own."""
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
            learner: Learner that continues.
            number: Number of the round, from 0.
            done: Number of segments so far, of all rounds.
            beginning: Policy of another skill that the first round begins with, and that guides
                it when it is resumed as well; None for random weights.
        """
        types = self.domain.types_by_name
        earlier = [load_episodes(episodes_path(self.folder, i), types) for i in range(done)]
        if beginning is not None:
            learner.begin_with(beginning, self.settings.warm_start)
        if done:
            # Where none has succeeded yet, the last one has learned most.
            previous = self._rounds[number - 1]
            begins = number == len(self._rounds)
            worse = begins and previous.segments[-1] < previous.success
            path = self.folder / "best.pt" if worse else self._checkpoint(done)
            learner.resume(path, earlier)

    def _judge(
        self, learner: SkillLearner, judge: Judge, done: int, before: Round | None
    ) -> Episodes | None:
        """Judge what was learned so far, and learn on meanwhile where that cannot be in vain.

        Args:
            learner: Learner after its latest segment.
            judge: Judge of the learner's policy.
            done: Number of segments so far, of all rounds.
            before: Round without this judgement; None where it is the round's first.

        Returns:
            The next segment's episodes; None where it was not learned yet.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        learner.save(self._checkpoint(done))
        policy = learner.policy()
        judge.begin(policy)
        last = before is not None and self._may_be_over(before)
        ahead = None if last else learner.learn(self.settings.segment_episodes)
        self._take_note(judge.verdict(), before)
        if self._rounds[-1].newest_is_best:
            self._keep_best(policy, done)
        self._write_rounds()  # until here the judgement, and its segment, count for nothing
        if before is not None:
            self._checkpoint(done - 1).unlink(missing_ok=True)
        return ahead

    def _may_be_over(self, before: Round) -> bool:
        """Whether a round may be over after one more judgement."""
        last = len(before.segments) + 1 == self.settings.segments(self.horizon)
        return last or self._is_good(before, judgements_left=1)

    def _is_good(self, judged: Round, judgements_left: int = 0) -> bool:
        """Whether enough judgements in a row are good, but for so many."""
        return judged.good(self.settings.enough, IN_A_ROW - judgements_left) or judged.good(
            self.needed, ENOUGH_IN_A_ROW - judgements_left
        )

    def _take_note(self, success: float, before: Round | None) -> None:
        if before is None:
            self._rounds.append(Round(success))
            return
        now = before.with_segment(success)
        over = len(now.segments) == self.settings.segments(self.horizon)
        self._rounds[-1] = replace(now, over=over or self._is_good(now))

    def _keep_best(self, policy: MlpPolicy, done: int) -> None:
        """Keep a policy as the best one, with its checkpoint."""
        draft = self.folder / "best.draft"
        shutil.copyfile(self._checkpoint(done), draft)
        draft.rename(self.folder / "best.pt")
        skill = AcquiredSkill(self.reward.operator, self.reward.template, policy, self.horizon)
        save_skill(self.folder / skill.folder_name, skill)

    def _checkpoint(self, segments: int) -> Path:
        return self.folder / f"{segments:03}.pt"

    def _write_rounds(self) -> None:
        data = [asdict(one) for one in self._rounds]
        write_whole(self.folder / ROUNDS, json.dumps(data))
