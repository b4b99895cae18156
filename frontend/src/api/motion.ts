/** The desk from which axes are moved. Who has the lease and what is under way comes over the socket. */
import { queryOptions } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";
import type { MotionData } from "./types";

type Schemas = components["schemas"];

export type Lease = Schemas["LeaseDoc"];
export type Interlock = Schemas["InterlockDoc"];
export type Homed = Schemas["HomedDoc"];
export type Moved = Schemas["MovedDoc"];
export type Positions = Schemas["Positions"];
export type Prepared = Schemas["PreparedDoc"];
export type Feathered = Schemas["FeatheredDoc"];
export type BrakeTest = Schemas["BrakeTestDoc"];

/** Every order bears the number of the lease, and one of its own that rises. */
export interface Order {
  fence: number;
  order: number;
}

const ROOT = "/api/live/motion";
const axis = (slug: string) => `/api/live/devices/${slug}/motion`;
const LOOK_MS = 1000;

/** What holds an axis back changes by itself: it is looked at as long as it is shown. */
export const interlocksQuery = (slug: string) =>
  queryOptions({
    queryKey: ["interlocks", slug],
    queryFn: ({ signal }) => get<Interlock[]>(`${axis(slug)}/interlocks`, signal),
    refetchInterval: LOOK_MS,
    staleTime: 0,
  });

export const moving = {
  take: (page: string) => send<Lease>("POST", `${ROOT}/lease`, { page }),
  ask: (page: string) => send<Lease>("POST", `${ROOT}/lease/ask`, { page }),
  withdraw: (page: string) => send<MotionData>("POST", `${ROOT}/lease/withdraw`, { page }),
  answer: (fence: number, handOver: boolean) =>
    send<MotionData>("POST", `${ROOT}/lease/answer`, { fence, hand_over: handOver }),
  giveBack: (fence: number) => send<MotionData>("POST", `${ROOT}/lease/give-back`, { fence }),
  confirm: (fence: number, rotorLocked: boolean, peopleOut: boolean, externalStops: readonly string[]) =>
    send<MotionData>("POST", `${ROOT}/confirm`, {
      fence,
      rotor_locked: rotorLocked,
      people_out: peopleOut,
      external_stops: externalStops,
    }),
  prepare: (slug: string, order: Order) => send<Prepared>("POST", `${axis(slug)}/prepare`, order),
  putBack: (slug: string, order: Order) => send<MotionData>("POST", `${axis(slug)}/put-back`, order),
  /** Where both encoders say that the blade is, asked now. */
  positions: (slug: string) => get<Positions>(`${axis(slug)}/positions`),
  /** Positions and speeds in the units of 607Ah and 60FFh: ° and °/s at a blade. */
  jog: (slug: string, order: Order, speed: number) =>
    send<Moved>("POST", `${axis(slug)}/jog`, { ...order, speed }),
  /** Of a hydraulic axis: to which side, at one of the two speeds that it holds for it. */
  manual: (slug: string, order: Order, positive: boolean, rapid: boolean) =>
    send<Moved>("POST", `${axis(slug)}/manual`, { ...order, positive, rapid }),
  operation: (slug: string, order: Order, single: boolean, aligned: boolean) =>
    send<Moved>("POST", `${axis(slug)}/operation`, { ...order, single, aligned }),
  move: (slug: string, order: Order, position: number, speed: number) =>
    send<Moved>("POST", `${axis(slug)}/move`, { ...order, position, speed }),
  home: (slug: string, order: Order, position: number) =>
    send<Moved>("POST", `${axis(slug)}/home`, { ...order, position }),
  searchHome: (slug: string, order: Order, method: number) =>
    send<Homed>("POST", `${axis(slug)}/search-home`, { ...order, method }),
  hold: (slug: string, order: Order) => send<Moved>("POST", `${axis(slug)}/hold`, order),
  feather: (slug: string, order: Order) => send<Feathered>("POST", `${axis(slug)}/feather`, order),
  brakeTest: (slug: string, order: Order) => send<BrakeTest>("POST", `${axis(slug)}/brake-test`, order),
  halt: (slug: string, fence: number) => send<MotionData>("POST", `${axis(slug)}/halt`, { fence }),
  reset: (slug: string, order: Order) => send<Moved>("POST", `${axis(slug)}/reset`, order),
};
