"""The index page: each figure of the paper beside our numbers, one file of plain HTML that also prints well."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Any

from gammastar.report.messages import SCENARIOS, Message
from gammastar.report.verdict import Judgement, Verdict

STYLE = """
:root { color-scheme: light dark; --ink: #222; --faint: #666; --line: #ddd; --paper: #fff; --card: #f6f6f6; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e6e6; --faint: #a0a0a0; --line: #3a3a3a; --paper: #161616; --card: #202020; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 76rem; padding: 2rem 1.25rem; font: 16px/1.5 system-ui, sans-serif; color: var(--ink);
  background: var(--paper); }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 .5rem; }
h2 { font-size: 1.3rem; margin: 3rem 0 .5rem; border-bottom: 1px solid var(--line); padding-bottom: .25rem; }
h3 { font-size: 1.05rem; margin: 0 0 .75rem; }
p { margin: .4rem 0; max-width: 46rem; }
a { color: inherit; }
nav a { margin-right: .7rem; white-space: nowrap; }
article { display: grid; grid-template-columns: minmax(0, 3fr) minmax(17rem, 2fr); gap: 1.5rem; padding: 1.5rem 0;
  border-bottom: 1px solid var(--line); break-inside: avoid; }
figure { margin: 0; }
img { display: block; width: 100%; height: auto; max-height: 44rem; object-fit: contain; background: #fff; border-radius: 4px;
  padding: 6px; }
figcaption, .note { color: var(--faint); font-size: .85rem; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; margin: .6rem 0; }
th, td { text-align: left; vertical-align: top; padding: .2rem .9rem .2rem 0; border-bottom: 1px solid var(--line); font-weight: 400; }
thead th { color: var(--faint); }
.wide { overflow-x: auto; }
.wide td, .wide th { white-space: nowrap; }
.verdict { display: inline-block; padding: .05rem .55rem; border-radius: 1rem; border: 1px solid currentColor; font-size: .85rem; }
.holds { color: #00795a; } .partly { color: #a86400; } .fails { color: #c24a00; }
@media (prefers-color-scheme: dark) { .holds { color: #35c79b; } .partly { color: #f0b040; } .fails { color: #ff8a4d; } }
@media (max-width: 50rem) { article { grid-template-columns: 1fr; } }
@media print {
  html { font-size: 11px; } body { max-width: none; padding: 0; font-size: 11px; } nav { display: none; }
  h2 { break-after: avoid; } img { max-height: 15cm; }
}
"""
CLASSES = {Verdict.HOLDS: "holds", Verdict.PARTLY: "partly", Verdict.FAILS: "fails"}
EFFORT_HEAD = ("min T/mg", "max T/mg", "rate [rad/s]", "torque [N m]")


def page(judged: Sequence[tuple[Message, Judgement]], numbers: dict[str, Any]) -> str:
    """Return the page as HTML; images are expected beside it as <stem>.png and <stem>.svg."""
    parts = [_head(judged, numbers["vehicle"])]
    for scenario, (section, title) in SCENARIOS.items():
        poles = escape(numbers["scenarios"][scenario]["poles"])
        parts.append(f'<h2 id="{scenario}">{escape(title)} <span class="note">section {section}</span></h2>')
        parts.append(f'<p class="note">Mission <code>{scenario}</code>; {poles}.</p>')
        parts += [_article(message, verdict) for message, verdict in judged if message.scenario == scenario]
    parts.append(_effort(numbers["effort"]))
    body = "\n".join(parts)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>Figures 3 to 17, flown again</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _head(judged: Sequence[tuple[Message, Judgement]], vehicle: dict[str, Any]) -> str:
    counts = [sum(verdict.verdict is each for _, verdict in judged) for each in Verdict]
    links = "".join(f'<a href="#{message.stem}">{message.number}</a>' for message, _ in judged)
    return (
        "<h1>Figures 3 to 17 of the paper, flown again</h1>\n"
        "<p>Path Following for a Class of Underactuated Systems Using Global Parameterization, section VI. Each figure is drawn from "
        "a flight of ours; beside it stand what the paper says of it, in our words, and our numbers. Every verdict is computed "
        f"from the numbers: {counts[0]} messages hold, {counts[1]} in part, {counts[2]} do not.</p>\n"
        "<p>Shapes are to be compared, not samples: the paper does not print its poles. World axes have the third one down, "
        "so the circle at x₃ = 10 m lies 10 m below the start; figures in space are drawn with height −x₃ upward.</p>\n"
        f"<p>The vehicle has {vehicle['mass_kg']:g} kg and a radius of gyration √(J/m) of {vehicle['radius_of_gyration_m']:.2f} m. "
        "Real quadrotors lie between 0.022 m (Crazyflie, 0.03 kg) and 0.14 m (Lee, Leok, McClamroch, 4.3 kg), so its torques say "
        "nothing about typical ones.</p>\n"
        f'<nav aria-label="Figures">{links}<a href="#effort">effort and poles</a><a href="numbers.json">numbers.json</a></nav>'
    )


def _article(message: Message, judged: Judgement) -> str:
    rows = "".join(f"<tr><th>{escape(what)}</th><td>{escape(value)}</td></tr>" for what, value in judged.numbers)
    remark = f"<p>{escape(judged.remark)}</p>" if judged.remark else ""
    title = escape(message.title)
    return (
        f'<article id="{message.stem}">\n<figure><a href="{message.stem}.svg"><img src="{message.stem}.png" alt="{title}" '
        f'loading="lazy"></a>\n<figcaption>{title}</figcaption></figure>\n<div>\n<h3>Figure {message.number} '
        f'<span class="verdict {CLASSES[judged.verdict]}">{judged.verdict.value}</span></h3>\n'
        f'<p><span class="note">The paper, section {message.section}:</span> {escape(message.claim)}</p>\n'
        f"<table><tbody>{rows}</tbody></table>\n{remark}\n</div>\n</article>"
    )


def _effort(effort: dict[str, Any]) -> str:
    head = "".join(f"<th>{name}</th>" for name in 2 * EFFORT_HEAD)
    rows = "".join(_effort_row(row) for row in effort["rows"])
    equal = effort["equal_torque_pole_per_s"]
    words = (
        "In this range the two starts never change places."
        if equal is None
        else f"The inverted start takes more torque with poles slower than {_minus(equal)} 1/s, and less with faster ones."
    )
    return (
        '<h2 id="effort">Effort and poles <span class="note">on section VI-B</span></h2>\n'
        "<p>All chains with all their poles at the one given, in closed form: nothing is flown. T/mg is thrust over weight; rate and "
        f"torque are peaks. {words}</p>\n"
        '<div class="wide"><table><thead><tr><th></th><th colspan="4">upright start</th><th colspan="4">upside-down start</th></tr>'
        f"<tr><th>pole [1/s]</th>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _effort_row(row: dict[str, Any]) -> str:
    cells = [
        f"<td>{_three_digits(value)}</td>" for start in ("upright", "upside_down") for value in row[start].values()
    ]
    return f"<tr><th>{_minus(row['pole_per_s'])}</th>{''.join(cells)}</tr>"


def _minus(value: float) -> str:
    return f"{value:.3g}".replace("-", "−")


def _three_digits(value: float) -> str:
    """Return a number with three digits that count, never in powers of ten for the sizes that occur here."""
    digits = max(0, 2 - math.floor(math.log10(abs(value)))) if value else 0
    return f"{value:.{digits}f}"
