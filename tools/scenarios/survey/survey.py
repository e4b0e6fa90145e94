"""Which expectation catches which error of a controller: a survey by mutation.

usage: survey.py ROWSCAN [--jobs N] [--only FAULT] [--all] [--seed N]

Runs the controller beside this file with each of its faults through the scenario that must catch it, and without a fault through all scenarios.
Prints a table in Markdown. Exit code 1: a fault is not caught by an expectation, or the good controller does not pass. `--all` runs each fault through
all scenarios, and tells how many more expectations it fails.
"""

import argparse
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from controller import FAULTS

# The scenario that must catch a fault.
CATCHES = {
    "row": [
        "no_delay", "delay_twice", "reversed", "wheel_speed", "speed_unit", "distance_unit",
        "never_closes", "heartbeat_stops", "uneven_pace", "wrong_group",
    ],
    "no-speed": ["holds_speed"],
    "cut": ["never_redials", "sleeps", "keeps_open", "leaks"],
    "half-open": ["no_timeout"],
    "lost": ["stale_scan", "lost_off_by_one", "repeats_counted"],
    "damaged": ["no_checksum", "junk_crash"],
    "dirty": ["ignores_dirt"],
    "stop": ["ignores_stop"],
    "echoes": ["start_angle", "last_echo"],
    "computing": ["slow"],
}
SCENARIO_OF = {fault: scenario for scenario, faults in CATCHES.items() for fault in faults}
# A controller that has crashed gives no verdicts: the bench says *error*.
CRASHES = {"junk_crash"}
LONGEST_S = 120


def verdicts(rowscan, seed, fault, scenario):
    """What `rowscan check` says of the controller with this fault: scenario, expectation, verdict, message."""
    path = Path(__file__).resolve().parent / ("%s.toml" % scenario)
    command = [rowscan, "check", str(path), "--format", "jsonl"]
    command += ["--seed", str(seed)] if seed is not None else []
    environment = {**os.environ, "SURVEY_FAULT": fault}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=LONGEST_S)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SystemExit("%s with the fault %s: %s" % (" ".join(command), fault, error))
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    found = [(scenario, line["name"], line["verdict"], line["message"]) for line in lines if line["kind"] == "verdict"]
    if not found:
        raise SystemExit("%s gave no verdict: %s" % (" ".join(command), done.stderr))
    return found


def row(fault, found):
    """The fault's row of the table, and whether all is as it must be."""
    wrong = [one for one in found if one[2] != "passed"]
    failed = [one for one in wrong if one[2] == "failed"]
    caught = (wrong if fault in CRASHES else failed)[:1]
    is_right = not wrong if fault == "none" else bool(caught)
    if fault == "none":
        told = "nothing, in %d expectations" % len(found) if is_right else "**%s**: %s" % (wrong[0][0], wrong[0][1])
    elif caught:
        scenario, name, verdict, _ = caught[0]
        name = name.split(". ", 1)[1].rsplit(" [seed", 1)[0]
        told = "`%s`: %s" % (scenario, name) + (" (*error*)" if verdict == "error" else "")
    else:
        told = "**not caught**"
    for scenario, name, verdict, message in wrong if not is_right else []:
        print("%s: %s: %s: %s: %s" % (fault, scenario, name, verdict, message), file=sys.stderr)
    return "| `%s` | %s | %s | %d |" % (fault, FAULTS[fault], told, max(len(wrong) - 1, 0)), is_right


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rowscan", help="the program")
    parser.add_argument("--jobs", type=int, default=2, help="runs side by side [2]")
    parser.add_argument("--only", choices=FAULTS, metavar="FAULT", help="only this one")
    parser.add_argument("--all", action="store_true", help="each fault through all scenarios")
    parser.add_argument("--seed", type=int, help="of scenes and faults, instead of the scenarios' own")
    asked = parser.parse_args()
    unknown = set(FAULTS) - {"none"} ^ set(SCENARIO_OF)
    if unknown:
        raise SystemExit("CATCHES and FAULTS differ in %s" % ", ".join(sorted(unknown)))
    faults = [asked.only] if asked.only else list(FAULTS)

    def scenarios(fault):
        first = SCENARIO_OF.get(fault)
        others = [scenario for scenario in CATCHES if scenario != first]
        return ([first] if first else []) + (others if asked.all or not first else [])

    pairs = [(fault, scenario) for fault in faults for scenario in scenarios(fault)]
    with ThreadPoolExecutor(max(asked.jobs, 1)) as pool:
        answers = list(pool.map(lambda pair: verdicts(asked.rowscan, asked.seed, *pair), pairs))
    found = {fault: [] for fault in faults}
    for (fault, _), answer in zip(pairs, answers):
        found[fault] += answer
    rows = [row(fault, found[fault]) for fault in faults]
    print("| fault | what it does wrong | caught by | others |\n|---|---|---|---|")
    print("\n".join(text for text, _ in rows))
    sys.exit(0 if all(is_right for _, is_right in rows) else 1)


main()
