import { createContext, useContext } from "react";
import type { Session } from "../../api/types";
import type { LiveStore } from "../../live/store";
import type { DeviceContext } from "../../model/shown";

/** The device whose values a component shows. */
export const DeviceContextOfTable = createContext<DeviceContext | null>(null);

export function useDevice(): DeviceContext {
  const context = useContext(DeviceContextOfTable);
  if (!context) throw new Error("no device around this component");
  return context;
}

/** All that the room shows at a time, and who looks at it. */
export interface Bench {
  /** The devices of the columns: one, or all of the kind side by side. */
  devices: readonly DeviceContext[];
  /** All devices of this kind of the turbine, the shown ones among them. */
  siblings: readonly DeviceContext[];
  side: boolean;
  /** What is known of their values. */
  store: LiveStore;
  /** What is shown is a recording: nothing can be read, changed or saved. */
  recorded: boolean;
  role: Session["role"];
  /** Short name of a device among its siblings: "Blade 2". */
  nameOf: (slug: string) => string;
  /** Addresses of the person's favourites. */
  starred: ReadonlySet<string>;
  toggleStar: (address: string) => void;
}

export const BenchContext = createContext<Bench | null>(null);

export function useBenchOfTable(): Bench {
  const bench = useContext(BenchContext);
  if (!bench) throw new Error("no bench around this component");
  return bench;
}
