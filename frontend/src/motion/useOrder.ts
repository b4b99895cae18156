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

export function useOrder() {
  return useMutation({
    mutationFn: async ({ held, work }: Given) => {
      const order = holding.next();
      if (order === null || (held && !holding.press(order.order))) throw new NotHolding();
      try {
        return await work(order);
      } finally {
        // What has ended must be pressed anew: the next press is another one.
        holding.letGo();
      }
    },
  });
}
