import { createContext, useContext } from "react";
import type { DeviceContext } from "../../model/shown";

export const DeviceContextOfTable = createContext<DeviceContext | null>(null);

export function useDevice(): DeviceContext {
  const context = useContext(DeviceContextOfTable);
  if (!context) throw new Error("no device around this component");
  return context;
}
