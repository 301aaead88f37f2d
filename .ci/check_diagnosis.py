"""Checks the JSON of a diagnosis against its contract, and prints the trail of the falling error.

`check_diagnosis.py result.json [--verdict VERDICT] [--effects A,B]`
"""

import argparse
import json
import math

parser = argparse.ArgumentParser()
parser.add_argument("result")
parser.add_argument("--verdict")
parser.add_argument("--effects")
arguments = parser.parse_args()

with open(arguments.result, encoding="utf-8") as file:
    result = json.load(file)


def check(condition, text):
    if not condition:
        raise SystemExit(f"{arguments.result}: {text}")


def number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def names(value):
    return isinstance(value, list) and all(isinstance(name, str) and name for name in value)


check(result.get("schema") == 4, f"schema is {result.get('schema')!r} instead of 4")
keys = ("verdict", "effects", "groups", "places", "acceptance", "ranked", "rankings", "steps", "noise_floor", "effort", "seconds")
for key in keys:
    check(key in result, f"no key {key!r}")
verdict, effects, groups, steps = (result[key] for key in ("verdict", "effects", "groups", "steps"))
check(verdict in ("effect", "undecided", "partial", "unexplained", "adequate"), f"verdict {verdict!r}")
check(names(effects), "effects is not a list of names")
check(number(result["noise_floor"]) and result["noise_floor"] > 0, "noise_floor is not positive")
check(number(result["seconds"]) and result["seconds"] > 0, "seconds is not positive")

check(len(groups) == len(effects), f"{len(effects)} effects but {len(groups)} groups")
for effect, group in zip(effects, groups):
    check(names(group) and group[0] == effect, f"the group {group} does not begin with {effect}")
    check(len(set(group)) == len(group), f"a name stands twice in the group {group}")
check((verdict in ("effect", "undecided", "partial")) == bool(effects), f"verdict {verdict} with effects {effects}")
if effects and verdict != "partial":
    alone = all(len(group) == 1 for group in groups)
    check(alone == (verdict == "effect"), f"verdict {verdict} with groups {groups}")

check(len(result["places"]) in (0, len(effects)), f"{len(effects)} effects but {len(result['places'])} lists of places")
for places in result["places"]:
    likelihoods = [place["relative_likelihood"] for place in places]
    check(all(number(one) and 0 <= one <= 1 for one in likelihoods), f"relative likelihoods {likelihoods}")
    check(likelihoods == sorted(likelihoods, reverse=True), f"the places are not the most likely first: {likelihoods}")
    check(names([place["place"] for place in places]), f"places {places}")

acceptance = result["acceptance"]
check(verdict != "adequate" or acceptance is None, "an acceptance test of an adequate model")
check(verdict != "partial" or acceptance is not None, "a partial answer without an acceptance test")
if acceptance is not None:
    check(names(acceptance["effects"]) and names([one["kind"] for one in acceptance["rejections"]]), f"acceptance {acceptance}")
    floors = acceptance["floor"]
    check(list(floors) == result["outputs"] and all(map(number, floors.values())), f"floor of the acceptance test is {floors}")
    for key in ("required", "required_partial", "required_bic_fall"):
        check(number(acceptance[key]), f"{key} of the acceptance test is {acceptance[key]!r}")
    for key in ("share", "share_test", "bic_fall"):
        check(acceptance[key] is None or number(acceptance[key]), f"{key} of the acceptance test is {acceptance[key]!r}")
    check(acceptance["share"] is None or acceptance["share"] <= 1, "more than all of the error is explained")
    check(acceptance["required_partial"] <= acceptance["required"], "a partial answer needs more than a whole one")
    if effects:
        check(acceptance["effects"] == effects, f"tested are {acceptance['effects']}, found {effects}")
    if verdict == "partial":
        check(number(acceptance["share"]), "a partial answer without its share")
        check(acceptance["share"] >= acceptance["required_partial"], "a partial answer that explains too little")
        check(not acceptance["rejections"], "a partial answer that does not meet a condition")

rankings, effort = result["rankings"], result["effort"]
check(names(rankings["white"]) and names(rankings["prewhitened"]), "a ranking is not a list of names")
check(isinstance(rankings["disagree"], bool), "disagree is neither true nor false")
check(effort["limit"] is None or number(effort["limit"]), f"limit {effort['limit']!r}")
check(names(effort["left_out"]) and isinstance(effort["interrupted"], bool), f"effort {effort}")

ranked = result["ranked"]
check(names(ranked) and len(set(ranked)) == len(ranked), "ranked is not a list of different names")
check(verdict != "adequate" or ranked[:1] == ["none"], "the model is adequate, but `none` is not ranked first")

check([step.get("added") for step in steps] == [None, *effects], "the steps do not add the effects in order")
for step in steps:
    for key in ("rmse", "bic"):
        check(number(step.get(key)), f"{key} of a step is {step.get(key)!r}")
    check(step["rmse"] > 0, "an error of zero")
    check("rmse_test" in step, "a step without rmse_test")
    check(step["rmse_test"] is None or number(step["rmse_test"]), "rmse_test is no number")
    parts = step["outputs"][0]["held_out_error"]
    if parts is not None:
        check(step["rmse_test"] is not None, "parts of an error on held-out records that are not there")
        squares = sum(parts[key] ** 2 for key in ("offset", "gain", "shape"))
        check(math.isclose(squares, step["rmse_test"] ** 2, rel_tol=1e-6), f"the parts {parts} are not of {step['rmse_test']}")
    check(step["parameters"], "a step without parameters")
    for parameter in step["parameters"]:
        error = parameter["std_error"]
        check(isinstance(parameter["name"], str) and isinstance(parameter["unit"], str), f"{parameter}")
        check(number(parameter["value"]) and (error is None or number(error)), f"{parameter}")
errors = [step["rmse"] for step in steps]
check(all(after < before for before, after in zip(errors, errors[1:])), f"the error does not fall: {errors}")

if arguments.verdict is not None:
    check(verdict == arguments.verdict, f"verdict {verdict} instead of {arguments.verdict}")
if arguments.effects is not None:
    wanted = arguments.effects.split(",") if arguments.effects else []
    check(effects == wanted, f"effects {effects} instead of {wanted}")

print(f"verdict {verdict}, noise floor {result['noise_floor']:.4g}, {result['seconds']:.2f} s")
for step in steps:
    held_out = "" if step["rmse_test"] is None else f", held out {step['rmse_test']:.4f}"
    print(f"  {step['added'] or 'the model':20} simulation error {step['rmse']:.4f}{held_out}")
