// Begins and ends a record, where the bridge allows that, and tells what it has and what came of it.
import {$} from "/parts.js";
import {ago, counted, put, size} from "/console/text.js";

export class Record {
  /// @param ask  path and, for a change, what is to be done; gives the answer
  constructor(ask) {
    this.ask = ask;
    this.state = null;
    this.fault = "";
    this.changing = false;
    $("record-button").onclick = () => this.change();
  }

  /// Asks the bridge how it stands.
  async look() {
    if (this.changing) return;
    const state = await (await this.ask("/record")).json();
    if (!this.changing) this.show(state);  // else it is of before the change
  }

  async change() {
    if (this.changing || this.state.stopping) return;
    this.changing = true;
    this.fault = "";
    try {
      this.show(await (await this.ask("/record", {do: this.state.recording ? "stop" : "start"})).json());
    } catch (error) {
      this.fault = error.message;
      this.show(this.state);
    }
    this.changing = false;
  }

  show(state) {
    this.state = state;
    $("record").hidden = !state.allowed && !state.recording;
    if ($("record").hidden) return;
    const {recording, stopping, last} = state;
    put($("record-button"), recording ? "Stop" : "Record");
    $("record-button").title = recording ? `Ends the record ${state.folder}` : "Records the topics of all routes";
    $("record-button").classList.toggle("running", recording);
    // Not disabled: it would lose the focus.
    $("record-button").setAttribute("aria-disabled", String(stopping));
    put($("record-now"), recording ? `${stopping ? "writing the rest, " : ""}${ago(state.running_s)}, ${counted(state.messages, "message")}, ${size(state.bytes)}` : "");
    if (this.fault) put($("record-last"), this.fault, "bad");
    else if (recording || !last) put($("record-last"), "", "");
    else put($("record-last"), `${last.ok ? "recorded: " : "the record failed: "}${last.words}`, last.ok ? "faint" : "bad");
  }
}
