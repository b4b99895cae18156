/** Names of groups and parameters of one description. */
import type { DescriptionDoc } from "../../../api/types";
import { titleOf } from "../../../model/rows";
import type { Translate } from "../../../texts/texts";
import { entriesOf } from "../../../ui/reading";

export interface FleetNames {
  group: (id: string) => string;
  parameter: (address: string) => string;
}

/** What no description names keeps its address or id. */
export function fleetNames(description: DescriptionDoc | undefined, t: Translate): FleetNames {
  return {
    group: (id) => (t.has(`group.${id}`) ? t(`group.${id}`) : id),
    parameter: (address) => {
      const entry = description && entriesOf(description).get(address);
      return entry ? titleOf(entry, t) : address;
    },
  };
}
