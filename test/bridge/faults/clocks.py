"""The time of day jumps. Timers, leases and timeouts go by the monotonic clock."""
from fault_world import ALL_FLOWS
from scenario import scenario

HOUR, YEAR = 3600, 365 * 86400
JUMPS = {"hour": HOUR, "ten-years": 10 * YEAR, "half-second": 0.5}


def add(name, by):
    @scenario(f"time-jumps-{name}", 8,
              f"the time of day of the bridge jumps by {name.replace('-', ' ')}: forward, back twice, forward")
    def jump(world):
        world.preload()
        world.honest(*ALL_FLOWS)

        def fault():
            for shift in by, 0, -by, 0:
                world.calls.shift_time(shift)
                world.pass_time(world.scale.attack_s / 2, f"{shift} s from now")
        world.hold_after(fault, undisturbed=True)


for each, seconds in JUMPS.items():
    add(each, seconds)


@scenario("time-starts-wrong", 8, "the bridge starts in 1970, and the time is set afterwards")
def starts_wrong(world):
    world.preload()
    world.calls.shift_time(-55 * YEAR)
    world.honest(*ALL_FLOWS)

    def fault():
        world.calls.shift_time(0)
        world.pass_time(world.scale.attack_s, "the time is right")
    world.hold_after(fault, undisturbed=True)
