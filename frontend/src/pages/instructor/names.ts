/** Words for faults, places and scenarios. */
import { useQuery } from "@tanstack/react-query";
import { useCallback } from "react";
import type { FaultParameter, InjectedFault } from "../../api/instructor";
import { turbineQuery } from "../../api/queries";
import type { Translate } from "../../texts/texts";
import { useTexts } from "../../texts/texts";
import { placesOf, stationName } from "../../ui/devices";
import { DURATION, numberText } from "./draft";

/** As many values are still offered by name. */
const MOST_CHOICES = 256;

export interface NodeChoice {
  node: number;
  slug: string;
  name: string;
}

/** The nodes of the connected turbine by the names of their devices. */
export function useNodeChoices(): NodeChoice[] {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data;
  return placesOf(turbine).map(({ station, device }) => ({
    node: device.node,
    slug: device.slug,
    name: `${stationName(station, t)} ${device.name}`,
  }));
}

/** Says where a fault acts: "Blade 2 PMC", "blade 2", "whole turbine". */
export function useWhere(): (
  fault: Pick<InjectedFault, "kind" | "blade" | "node">,
  onBus: boolean,
) => string {
  const t = useTexts();
  const nodes = useNodeChoices();
  return useCallback(
    ({ blade, node }, onBus) => {
      if (node !== null) {
        return nodes.find((one) => one.node === node)?.name ?? t("page.instructor.node", { node });
      }
      if (blade !== null) return t("page.blade", { blade });
      return t(onBus ? "page.instructor.all_nodes" : "page.instructor.whole_turbine");
    },
    [nodes, t],
  );
}

/** The values of a parameter that have names, where it is a choice among names. */
export function choicesOf(parameter: FaultParameter, t: Translate): { value: number; name: string }[] {
  if (!parameter.integer || parameter.high - parameter.low >= MOST_CHOICES) return [];
  const all = Array.from({ length: parameter.high - parameter.low + 1 }, (_, at) => parameter.low + at);
  return all
    .map((value) => ({ value, key: `fault_value.${parameter.name}.${value}` }))
    .filter(({ key }) => t.has(key))
    .map(({ value, key }) => ({ value, name: t(key) }));
}

export function parameterName(parameter: FaultParameter, t: Translate): string {
  return parameter === DURATION ? t("page.instructor.seconds") : t(`fault_parameter.${parameter.name}`);
}

/** `Remaining voltage 0 %, Phase L1`: the first value, and of the others those that are not the usual ones. */
export function valuesText(
  fault: InjectedFault,
  parameters: readonly FaultParameter[],
  t: Translate,
): string {
  return parameters
    .flatMap((parameter, at) => {
      const number = fault.values[parameter.name];
      if (number === undefined || (at > 0 && number === parameter.default)) return [];
      const named = choicesOf(parameter, t).find(({ value }) => value === number)?.name;
      const plain = `${numberText(parameter, number, t.language)} ${parameter.unit}`.trim();
      return [`${parameterName(parameter, t)} ${named ?? plain}`];
    })
    .join(", ");
}

/** The title of a scenario in the language of the page, where the catalogue has one; else as its file says it. */
export function scenarioTitle(name: string, title: string, t: Translate): string {
  const key = `scenario.${name}.title`;
  return t.has(key) ? t(key) : title;
}
