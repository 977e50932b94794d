"""The style sheet of the report: light and dark, from a phone's width to paper."""

#: Verdicts are told by words; the colours (after Okabe and Ito) help the eye.
STYLE = """
:root { color-scheme: light dark; --paper: #fff; --ink: #1c1f23; --muted: #59616b; --line: #d4d9df; --soft: #f4f6f8;
  --link: #0a5a94; --model: #0072b2; --other: #56b4e9; --rig: #d55e00; --zone: #dfe5ea; --notice: #fff3d1;
  --agrees: #cfeadd; --part: #fdeab5; --undecided: #dfe3e8; --differs: #f9cfbd; --input: #e4dcf3; --adds: #d3e9f8; }
@media screen and (prefers-color-scheme: dark) { :root { --paper: #14171a; --ink: #e6e9ec; --muted: #a3acb6;
  --line: #3a424b; --soft: #1d2227; --link: #7cc0f0; --model: #56b4e9; --other: #a9d9f5; --rig: #ff9a52;
  --zone: #2c343c; --notice: #4a3b10; --agrees: #1d4f3b; --part: #594609; --undecided: #3a424b; --differs: #6d2d16;
  --input: #42366a; --adds: #1b4763; } }
* { box-sizing: border-box; }
body { font: 1rem/1.5 system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif; color: var(--ink);
  background: var(--paper); max-width: 72rem; margin: 0 auto; padding: 1.2rem 1rem 4rem; overflow-wrap: break-word; }
h1, h2, h3 { line-height: 1.2; text-wrap: balance; } h1 { font-size: 1.7rem; margin: .4rem 0 .6rem; }
h2 { font-size: 1.3rem; margin: 2.4rem 0 .8rem; padding-bottom: .25rem; border-bottom: 2px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.6rem 0 .5rem; } p, li, figcaption, dd { max-width: 62rem; }
a { color: var(--link); } p { margin: .6rem 0; }
.notice { background: var(--notice); padding: .5rem .8rem; border-radius: .3rem; }
.lines { display: grid; grid-template-columns: 9rem 1fr; gap: .5rem 1rem; margin: 1rem 0; font-size: 1.06rem; }
.lines dt { font-weight: 700; } .lines dd { margin: 0; }
.tally { display: grid; grid-template-columns: max-content 1fr; gap: .3rem 1rem; align-items: center;
  margin: 1rem 0 .4rem; }
.bar { display: flex; gap: 2px; } .bar span { min-width: 1.5rem; text-align: center; padding: .15rem 0;
  font-weight: 600; } .who { font-size: .9rem; } .chips { display: flex; flex-wrap: wrap; gap: .3rem; }
.chips span { font-size: .82rem; padding: .05rem .5rem; border-radius: .2rem; }
figure { margin: 1.2rem 0; } figure img { max-width: 100%; height: auto; background: #fff; border-radius: .2rem; }
figcaption { font-size: .88rem; color: var(--muted); }
.comparison .grid { display: grid; grid-template-columns: minmax(10rem, 19rem) 1fr auto; gap: 0 .8rem;
  align-items: center; grid-auto-flow: row dense; } .comparison .label { grid-column: 1; }
.comparison .axis { grid-column: 2; } .comparison .values { grid-column: 3; }
.comparison .label, .comparison .values { font-size: .88rem; padding: .15rem 0; }
.comparison .values { font-variant-numeric: tabular-nums; white-space: nowrap; display: flex; }
.values span { width: 3.7rem; text-align: right; } .values .s0 { color: var(--model); } .values .s1 {
  color: var(--muted); } .values .s2 { color: var(--rig); }
.axis { position: relative; height: 1.7rem; } .axis i { position: absolute; display: block; }
.zone { top: 0; bottom: 0; background: var(--zone); } .zero { left: 50%; top: 0; bottom: 0; width: 1px;
  background: var(--muted); }
.m { width: .7rem; height: .7rem; top: 50%; transform: translate(-50%, -50%); } .m.s0 { background: var(--model);
  border-radius: 50%; } .m.s1 { border: 2px solid var(--other); border-radius: 50%; width: .95rem; height: .95rem; }
.m.s2 { background: var(--rig); transform: translate(-50%, -50%) rotate(45deg); width: .6rem; height: .6rem; }
.u { height: 2px; top: calc(50% - 1px); } .u.s0 { background: var(--model); } .u.s1 { background: var(--other); }
.u.s2 { background: var(--rig); }
.ticks span { position: absolute; transform: translateX(-50%); font-size: .78rem; color: var(--muted);
  white-space: nowrap; } .ticks span:first-child { transform: none; } .ticks span:last-child {
  transform: translateX(-100%); }
.key { display: flex; flex-wrap: wrap; gap: .2rem 1.4rem; font-size: .88rem; margin-bottom: .4rem; }
.key span { display: inline-flex; align-items: center; gap: .5rem; } .key i { position: static; transform: none;
  display: inline-block; } .key .m.s2 { transform: rotate(45deg); } .key .zone { width: 1.4rem; height: .9rem; }
nav { background: var(--soft); border-radius: .3rem; padding: .6rem 1rem; margin: 1.6rem 0; font-size: .92rem; }
nav p { margin: 0; font-weight: 700; } nav ul { margin: .2rem 0; padding-left: 1.1rem; } nav > ul { padding-left: 0;
  list-style: none; } nav ul ul { columns: 21rem; column-gap: 2rem; font-size: .92em; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: .86rem; line-height: 1.35; width: 100%; }
th, td { padding: .32rem .5rem; text-align: left; vertical-align: top; } th { background: var(--soft);
  border-bottom: 2px solid var(--line); } tbody { border-bottom: 1px solid var(--line); break-inside: avoid; }
.note td { color: var(--muted); padding-top: 0; font-size: .95em; }
.v-agrees { background: var(--agrees); } .v-in_part { background: var(--part); } .v-undecided {
  background: var(--undecided); } .v-differs { background: var(--differs); } .v-input { background: var(--input); }
.v-adds { background: var(--adds); } .v-not_asked { color: var(--muted); } .bar .v-not_asked, .chips .v-not_asked {
  background: var(--soft); }
@media screen and (max-width: 52rem) {
  .lines { grid-template-columns: 1fr; gap: .1rem; font-size: 1rem; } .lines dd { margin-bottom: .6rem; }
  .tally { grid-template-columns: 1fr; gap: .1rem; } .bar span { min-width: 1.1rem; font-size: .85rem; }
  .values .s1 { display: none; } .comparison .grid { grid-template-columns: 1fr auto; }
  .comparison .values { grid-column: 2; }
  .comparison .axis { grid-column: 1 / -1; height: 1.2rem; margin-bottom: .35rem; }
  table thead { display: none; } table, table tbody, table tr,
  table td { display: block; } table tbody { padding: .5rem 0; }
  table td { padding: .15rem .4rem; } table td:empty { display: none; }
  table td[data-label]::before { content: attr(data-label) ": "; color: var(--muted); }
  td:first-child { font-weight: 700; } nav ul ul { columns: 1; } h1 { font-size: 1.4rem; }
}
@media print { html { font-size: 9.5pt; } body { max-width: none; padding: 0; } h2 { break-after: avoid; } figure {
  break-inside: avoid; } nav { display: none; } a { color: inherit; text-decoration: none; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
"""
