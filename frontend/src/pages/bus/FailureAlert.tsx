import { Problem } from "../../api/client";
import type { Failure } from "../../api/types";
import { ProblemAlert } from "../../ui/ProblemAlert";

/** What did not succeed, as part of a result: in the words of any other error, with what to do next. */
export function FailureAlert({ failure, title }: { failure: Failure; title: string }) {
  const { code, text_key, details } = failure;
  const error = new Problem({
    type: `urn:hubside:error:${code}`,
    title: code,
    status: 0,
    code,
    text_key,
    details,
    device_state: null,
  });
  return <ProblemAlert error={error} title={title} />;
}
