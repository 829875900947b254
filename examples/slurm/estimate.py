#!/usr/bin/env python3
"""How long an iteration of a fit takes on many machines, from pieces measured on one: python3 estimate.py [OPTION=VALUE…]

    seconds     of one half of a view in one piece, sampling alone         (measured: --seconds of drt grad at half the spp)
    prepare     seconds to prepare the scene, on every rank                (measured: drt info)
    merge       seconds to merge 1 GB of sums                              (measured: drt merge)
    spread      relative standard deviation of the times of shards         (measured)
    views, pixels, parameters, sources                                     (of the job; sources of boundary samples)
    strata      32, or fewer where there are few samples
    bandwidth   bytes a second into and out of a machine, latency seconds  (of the network)

Prints per number of machines: seconds of an iteration, how much of the work of one machine each does for it (efficiency),
and the bytes into the machine that gets most.
"""
import random
import sys

DEFAULTS = dict(
    seconds=20.0, prepare=0.02, merge=1.5, spread=0.05, views=10, pixels=256 * 256, parameters=10, sources=3,
    strata=32, bandwidth=1.25e9, latency=50e-6,
)
# A colour in 64-bit floats.
COLOUR = 24


def share(i, m, n):
    return n * i // m, n * (i + 1) // m


def iteration(ranks, o, rng):
    """Seconds and most bytes into one machine."""
    halves = 2 * o["views"]
    image = COLOUR * o["pixels"] * (1 + o["parameters"])
    splats = COLOUR * o["pixels"] * o["parameters"] * o["sources"]
    slow = lambda: max(0.2, rng.gauss(1.0, o["spread"]))
    gathered = 0
    if ranks <= halves:
        done = []
        for r in range(ranks):
            first, last = share(r, ranks, halves)
            views = len({h // 2 for h in range(first, last)})
            done.append(views * o["prepare"] + sum(o["seconds"] * slow() for _ in range(first, last)))
        worked = max(done)
    else:
        ends = []
        for h in range(halves):
            first, last = share(h, halves, ranks)
            count = min(last - first, o["strata"])
            worked = o["prepare"] + max(o["seconds"] / count * slow() for _ in range(count))
            # All strata but the leader's own go to it, and are merged there.
            sums = (image + splats) * o["strata"]
            gathered = sums * (count - 1) / count
            ends.append(worked + gathered / o["bandwidth"] + count * o["latency"] + sums / 1e9 * o["merge"])
        worked = max(ends)
    # Then every half's means go round to every machine.
    means = image * halves * (1 if ranks > 1 else 0)
    return worked + means / o["bandwidth"] + ranks * o["latency"], gathered + means


def main():
    o = dict(DEFAULTS)
    for word in sys.argv[1:]:
        key, _, value = word.partition("=")
        if key not in o:
            sys.exit(f"estimate.py: there is no option {key}; there are {', '.join(o)}")
        o[key] = type(o[key])(float(value))
    print("machines  seconds/iteration  efficiency  MB into one machine")
    one = None
    for ranks in [1, 2, 4, 8, 16, 20, 40, 80, 160, 320, 640, 1000]:
        rng = random.Random(1)
        trials = [iteration(ranks, o, rng) for _ in range(20)]
        seconds = sum(t for t, _ in trials) / len(trials)
        one = one or seconds
        print(f"{ranks:8}  {seconds:17.3f}  {one / (ranks * seconds):10.3f}  {trials[0][1] / 1e6:19.0f}")


if __name__ == "__main__":
    main()
