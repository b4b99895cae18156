/** What is wrong with the turbine that is edited, by field, for the fields below. */
import { createContext, useContext } from "react";

export type FlawTexts = Map<string, string>;

export const FlawContext = createContext<FlawTexts>(new Map());

export function useFlaw(at: string): string | undefined {
  return useContext(FlawContext).get(at);
}
