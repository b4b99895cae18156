/** Device contexts for dialogs that are about many devices, of kinds that the table may not show. */
import { useQueries } from "@tanstack/react-query";
import { useMemo } from "react";
import { useDescriptionQuery } from "../../api/queries";
import type { DescriptionDoc } from "../../api/types";
import { useStore } from "../../live/live";
import type { LiveStore } from "../../live/store";
import type { DeviceContext } from "../../model/shown";
import type { Lookup } from "../../model/values";
import { asVariant, variantOf } from "../../model/variant";
import { type Translate, useTexts } from "../../texts/texts";
import type { Place } from "../../ui/devices";
import { rawOf } from "./cellValue";

export function contextOf(place: Place, doc: DescriptionDoc, t: Translate, store: LiveStore): DeviceContext {
  const { slug, node } = place.device;
  const lookup: Lookup = (address) => rawOf(store.cell(slug, address));
  return {
    slug,
    node,
    get doc() {
      return asVariant(doc, variantOf(doc, lookup));
    },
    t,
    lookup,
  };
}

/** The devices whose description is loaded, by slug. */
export function useContexts(places: readonly Place[]): ReadonlyMap<string, DeviceContext> {
  const t = useTexts();
  const store = useStore();
  const describe = useDescriptionQuery();
  const ids = [...new Set(places.map((one) => one.device.description_id))];
  const docs = useQueries({
    queries: ids.map((id) => describe(id)),
    combine: (results) => results.map((one) => one.data),
  });
  return useMemo(() => {
    const found = new Map<string, DeviceContext>();
    for (const place of places) {
      const doc = docs.find((one) => one?.id === place.device.description_id);
      if (doc) found.set(place.device.slug, contextOf(place, doc, t, store));
    }
    return found;
  }, [places, docs, t, store]);
}
