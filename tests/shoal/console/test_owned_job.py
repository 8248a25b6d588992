"""Jobs that users have made: who may end them."""

import asyncio

import pytest

from shoal.console import Role, User
from shoal.console.owned_job import OwnedJob
from shoal.console.page_job import PageJob, PageJobError

ANNA, BEN, CARL = User("anna", Role.OPERATE), User("ben", Role.OPERATE), User("carl", Role.MAINTAIN)


def test_a_job_is_ended_by_its_owner_or_who_may_maintain_and_by_nobody_else(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[bool] = []

    async def run(*_: object) -> dict[str, object]:
        while not ended:
            await asyncio.sleep(0)
        ended.clear()
        raise PageJobError("cancelled")

    async def act() -> None:
        job = OwnedJob("nothing", "has a report made")
        for user in (ANNA, CARL):
            running = asyncio.create_task(job.run(ANNA, {}))
            await asyncio.sleep(0)
            with pytest.raises(PageJobError, match="anna has a report made, for 0 s now: wait until it is over"):
                await job.run(BEN, {})
            assert job.cancel(BEN) == "anna has a report made, and may cancel it"
            assert not ended
            assert job.cancel(user) == ""
            with pytest.raises(PageJobError, match="cancelled"):
                await running

    monkeypatch.setattr(PageJob, "run", run)
    monkeypatch.setattr(PageJob, "cancel", lambda _: ended.append(True))
    asyncio.run(act())
