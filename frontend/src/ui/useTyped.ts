import { useEffect, useRef, useState } from "react";

const URL_DELAY_MS = 300;

/** What is typed counts at once; the URL follows when the typing pauses, and a link that changes it is followed. */
export function useTyped(inUrl: string, write: (typed: string) => void): [string, (typed: string) => void] {
  const [typed, setTyped] = useState(inUrl);
  const [seen, setSeen] = useState(inUrl);
  const [written, setWritten] = useState(inUrl);
  if (seen !== inUrl) {
    setSeen(inUrl);
    // Our own writing comes back late: what was typed since stays.
    if (inUrl !== written) setTyped(inUrl);
  }
  const latest = useRef(write);
  useEffect(() => {
    latest.current = write;
  });
  useEffect(() => {
    if (typed === inUrl) return;
    const timer = setTimeout(() => {
      setWritten(typed);
      latest.current(typed);
    }, URL_DELAY_MS);
    return () => clearTimeout(timer);
  }, [typed, inUrl]);
  return [typed, setTyped];
}
