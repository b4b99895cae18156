/** Faults and scenarios for the twins that the server has started; what acts now comes over the socket. */
import { queryOptions } from "@tanstack/react-query";
import { get, remove, send } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type FaultKind = Schemas["FaultKindDoc"];
export type FaultParameter = Schemas["FaultParameterDoc"];
export type FaultOrder = Schemas["FaultOrderDoc"];
export type InjectedFault = Schemas["InjectedLine"];
export type Playing = Schemas["PlayingLine"];
export type Scenario = Schemas["ScenarioDoc"];
type Line = Schemas["InstructorLine"];

const ROOT = "/api/instructor";

export const faultKindsQuery = queryOptions({
  queryKey: ["instructor", "catalogue"],
  queryFn: ({ signal }) => get<FaultKind[]>(`${ROOT}/catalogue`, signal),
});

export const scenariosQuery = queryOptions({
  queryKey: ["instructor", "scenarios"],
  queryFn: ({ signal }) => get<Scenario[]>(`${ROOT}/scenarios`, signal),
  // Files may come and go while the page is open.
  staleTime: 0,
});

export const instructing = {
  inject: (order: FaultOrder) => send<InjectedFault>("POST", `${ROOT}/faults`, order),
  clear: (fault: number) => remove<Line>(`${ROOT}/faults/${fault}`),
  clearAll: () => remove<Line>(`${ROOT}/faults`),
  play: (scenario: string) => send<Line>("POST", `${ROOT}/play`, { scenario }),
  stop: () => send<Line>("POST", `${ROOT}/stop`, {}),
};
