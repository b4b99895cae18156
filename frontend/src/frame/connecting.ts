/** Connecting to a turbine and ending the connection, from wherever in the page. */
import { useMutation } from "@tanstack/react-query";
import { queryClient, turbineQuery } from "../api/queries";
import { connecting, knownTurbinesQuery } from "../api/settings";
import { useTexts } from "../texts/texts";
import { notify } from "../ui/notices";
import { storyOf } from "../ui/problem";

export interface Connecting {
  connect: (slug: string) => void;
  disconnect: () => void;
  busy: boolean;
}

export function useConnecting(): Connecting {
  const t = useTexts();
  const failed = (title: string) => (error: unknown) => {
    const story = storyOf(error, t);
    notify({ tone: "error", title, lines: [story.happened, story.next] });
  };
  const settle = async () => {
    await queryClient.invalidateQueries({ queryKey: turbineQuery.queryKey });
    await queryClient.invalidateQueries({ queryKey: knownTurbinesQuery.queryKey });
  };
  const connect = useMutation({
    mutationFn: connecting.connect,
    onError: failed(t("page.connect.failed")),
    onSettled: settle,
  });
  const disconnect = useMutation({
    mutationFn: connecting.disconnect,
    onError: failed(t("page.connect.disconnect_failed")),
    onSettled: settle,
  });
  return {
    connect: connect.mutate,
    disconnect: () => disconnect.mutate(),
    busy: connect.isPending || disconnect.isPending,
  };
}
