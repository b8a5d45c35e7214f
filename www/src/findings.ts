/** What is wrong with the scan, file by file: expected, found, what to do. */
import type { FindingMessage } from "./ipdrecon/index.js";
import { counted } from "./ipdrecon/index.js";
import { byId, make, write } from "./dom.js";
import type { Model } from "./model.js";

/** More than this nobody reads, and the page would have to lay out. */
const MOST_SHOWN = 60;
const list = byId("findings-list");
let drawn: FindingMessage[] | undefined;

/** Draws the findings. */
export function drawFindings({ findings }: Model): void {
  byId("findings").hidden = findings.length === 0;
  if (findings === drawn) return;
  drawn = findings;
  write(byId("findings-title"), `${counted(findings.length, "finding")} about the scan`);
  list.replaceChildren(...findings.slice(0, MOST_SHOWN).map(item));
  const more = findings.length - MOST_SHOWN;
  if (more > 0) list.append(make("li", `and ${counted(more, "more finding")}, all in the report`, "muted"));
}

function item(finding: FindingMessage): HTMLElement {
  const li = make("li", "", finding.severity);
  const where = place(finding);
  if (where) li.append(make("code", where), make("br"));
  li.append(`Expected ${finding.expected}; found ${finding.found}. `, make("span", finding.advice, "muted"));
  return li;
}

/** A file and its line, as compilers write them. */
export function place({ file, line }: FindingMessage): string {
  return file ? `${file}${line ? `:${line}` : ""}` : "";
}
