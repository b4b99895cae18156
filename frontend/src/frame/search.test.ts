import { describe, expect, it } from "vitest";
import { parseSearch, readSearch, roomSearch, stringifySearch, type PageSearch } from "./search";

const LOOKS =
  "lang=de&theme=light&scene=off&camera=hub&ghost=off&events=open&eventq=bus&severity=error&drawer=tall";
const ABOUT = "replay=3-following-error&at=1750000000000000000&device=wtg-07/blade-2/pmc&blade=2";
const OWN =
  "q=temp&only=changed&view=side&review=open&closed=a,b&sort=-name&hide=unit&edit=3110:01&span=120&file=a.mcap&find=x" +
  "&order=-size&less=hash&compare=different&node=12&set=percent:30&scenario=mains_failure&procedure=back_up&section=users&person=a&kind=write&tab=nodes&nodes=1,2" +
  "&services=sdo&ids=18B&data=40&dir=tx&errors=1&paused=1&frame=1750000000000000000";
const everything = (): PageSearch => readSearch(parseSearch(`${LOOKS}&${ABOUT}&${OWN}`));

describe("the search of the URL", () => {
  it("keeps everything that it knows within a room", () => {
    expect(
      stringifySearch({ ...everything() })
        .slice(1)
        .split("&")
        .toSorted(),
    ).toEqual(`${LOOKS}&${ABOUT}&${OWN}`.split("&").toSorted());
  });

  it("takes to another room how the page looks and what it is about, and nothing that belongs to one room", () => {
    expect(roomSearch(everything())).toEqual(readSearch(parseSearch(`${LOOKS}&${ABOUT}`)));
  });

  it("opens another room with what is to be seen there", () => {
    const search = roomSearch(everything(), { device: "wtg-07/blade-3/pmm", q: "3080" });
    expect(search.device).toBe("wtg-07/blade-3/pmm");
    expect(search.q).toBe("3080");
    expect(search.only).toBeUndefined();
  });

  it("leaves out what is damaged", () => {
    expect(readSearch({ lang: "fr", theme: "pink", view: "top", q: "", edit: 7, device: "a" })).toEqual({
      device: "a",
    });
  });
});
