/** An order to an axis that lasts as long as it is held; its result comes when it has ended. */
import { useMutation } from "@tanstack/react-query";
import type { Order } from "../api/motion";
import { holding } from "./lease";

/** Thrown where this page cannot hold: it has no lease, or its socket is not open. */
export class NotHolding extends Error {}

interface Given {
  held: boolean;
  work: (order: Order) => Promise<unknown>;
}

interface Pressed {
  /** Null: it cannot be held. */
  order: Order | null;
  work: (order: Order) => Promise<unknown>;
}

export function useOrder() {
  const mutation = useMutation({
    mutationFn: async ({ order, work }: Pressed) => {
      if (order === null) throw new NotHolding();
      try {
        return await work(order);
      } finally {
        // What has ended must be pressed anew: the next press is another one.
        holding.letGo();
      }
    },
  });
  // Pressed now, while the finger is there, never when the request gets its turn.
  const mutate = ({ held, work }: Given) => {
    const next = holding.next();
    const order = next === null || (held && !holding.press(next.order)) ? null : next;
    mutation.mutate({ order, work });
  };
  return { ...mutation, mutate };
}
