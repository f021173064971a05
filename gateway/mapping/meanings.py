"""What every key of a profile means, for the reference and for editors. Data.

Keys stand under the model that declares them; a model that inherits a key means the same by it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Meaning(NamedTuple):
    """What a key means, an example of its value, and what holds when it is absent, if the model does not
    tell that."""

    text: str
    example: str = ""
    default: str = ""


M = Meaning

PROFILE: Mapping[str, Mapping[str, Meaning]] = {
    "RawProfile": {
        "profile": M("name of the profile; equals the file name", "teco-7200gs"),
        "title": M("what a person calls it", "TECO 7200GS with SI-M card"),
        "maker": M("nameplate: the maker", "TECO"),
        "models": M("nameplate: the models that it fits", "[7200GS]"),
        "version": M("raised at each change of the file", "1"),
        "like": M(
            "start from that profile: tables merge by name, lists and scalars are replaced, `null` removes",
            "delta-vfd",
        ),
        "documents": M("short id to the document that it stands for", "{sim: SI-M manual}"),
        "addresses": M("notations of the manual, by pattern", "Cn-<n>: {n: 1, add: 01FFH, ...}"),
        "serial": M("facts of the serial interface"),
        "modbus": M("facts of the protocol"),
        "settings": M("facts that only the panel or plant knows; given per drive in the site file"),
        "values": M("tables of values that several points share, by name", "{source: {0: line, 1: panel}}"),
        "errors": M("exception codes by number", "22H: locked", "01H to 04H as in the standard"),
        "groups": M("points that belong together, with what they share"),
        "commands": M("sequences of writes by name; `stop` overtakes everything"),
        "broadcast": M("what may be sent to all drives of a line at once", default="not supported"),
        "simulate": M("assumptions for the simulated twin; only `gateway simulate` looks at them"),
    },
    "Sourced": {
        "source": M(
            "document id, then the place in it; `ours` for what is in no document, which needs a `doubt`",
            "sim 9.2",
            "that of the section above",
        ),
        "doubt": M("why this may be wrong; shown with the value", "hold time not stated"),
    },
    "Document": {
        "title": M("what a person calls the document", "SI-M manual"),
        "similar": M("it is about another model: all that comes from it is shown as unverified", "true"),
    },
    "Notation": {
        "example": M("one pair out of the manual, recomputed when the file is read", "Cn-42 = 0229H"),
        "add": M("constant of the sum", "01FFH"),
        "table": M("which of the four Modbus tables", "coil"),
    },
    "Fact": {"is": M("the fact itself, where it carries `source` or `doubt`", "{is: 20, source: sc3 p.129}")},
    "Serial": {
        "baud": M("speeds, factory setting first", "[9600, 4800, 2400]"),
        "rtu": M(
            "formats in RTU, factory setting first; `rtu` or `ascii` must be there", "[8N2]", "not spoken"
        ),
        "ascii": M("formats in ASCII, factory setting first", "[7E1]", "not spoken"),
        "units": M("unit addresses", "1..31", "1..247"),
        "gap": M("least silence between frames; the longer of it and 3.5 characters counts", "10ms", "0ms"),
        "reply": M(
            "usual time to the first character, and the one after which none comes", "20ms..500ms", "10ms..1s"
        ),
        "pause": M("silence to keep after a read, a write, a broadcast", "{write: 50ms}"),
        "comm_loss": M("what the drive does when the line dies", "{after: 2s, action: f5_04}", "not known"),
    },
    "Pauses": {
        "read": M("after a read", "5ms", "0ms"),
        "write": M("after a write", "50ms", "0ms"),
        "broadcast": M("after a broadcast", "200ms", "100ms"),
    },
    "CommLoss": {
        "after": M(
            "silence after which the drive takes the line for dead; or the point or setting with it, in s",
            "2s",
            "never, or not known",
        ),
        "action": M("point or setting that tells what it does then", "f5_04"),
        "when": M("it does so only then", "{f5_05: with_detection}", "always"),
        "stops_when": M(
            "the motor stops then if this holds too, and runs on if not",
            "{f5_04: [coast, ramp]}",
            "not known",
        ),
    },
    "Modbus": {
        "functions": M("function codes spoken", "[03H, 10H]", "[03H, 06H, 10H]"),
        "write_one": M("function for one register", "06H", "06H if spoken, else 10H"),
        "read_max": M("registers in one read", "16", "125"),
        "write_max": M("registers in one write", "16", "123"),
        "bridge": M("a read may pass over addresses that no entry names", "true", "false"),
        "holes": M("never passed over, even with `bridge`", "[0034H..003CH]"),
        "probe": M("cheapest question: `loop_back` or a point", "loop_back", "the first status point"),
        "words": M("order of values of several registers", "low_first", "high_first"),
        "identity": M(
            "what the drive shows if it is of this model; until it was seen, nothing of it is believed",
            "{drive_type: 15}",
            "nothing tells",
        ),
        "error_functions": M("function bytes that also mean an error reply", "A0H..A3H", "function + 80H"),
    },
    "Setting": {
        "unit": M("what one count is worth", "1 Hz", "a plain number"),
        "range": M("limits", "0..39"),
        "default": M("value if the site is silent", "0", "the site must give it"),
        "values": M("names of its values", "{0: coast, 1: keep_running}"),
        "help": M("one sentence for the operator", "frequency unit"),
    },
    "NamedValue": {
        "name": M("what the raw value is called", "jog"),
        "help": M("one sentence for the operator", "jogging"),
    },
    "ErrorCode": {
        "name": M(
            "the reason: `illegal_function`, `illegal_address`, `illegal_count`, `illegal_value`, `locked`, "
            "`undervoltage`, `busy` or `drive_failure`",
            "locked",
        ),
        "help": M("one sentence for the operator", "the motor runs"),
        "retry": M("temporary: ask again after this, within the request's deadline", "200ms", "no retry"),
        "retry_when": M("ask again once this holds", "{warning_uv: false}"),
    },
    "Traits": {
        "kind": M("sort of thing; gives access, role and rate", "parameter", "status"),
        "type": M("`u16 s16 u32 s32 u64 f32 bcd`, or `text 20` (registers)", "s16", "u16"),
        "words": M("order of values of several registers", "low_first", "that of `modbus`"),
        "unit": M("what one count is worth", "0.01 Hz", "a plain number"),
        "times": M("setting or point that multiplies", "e1_04", "1"),
        "offset": M("added last, in the unit", "-40", "0"),
        "values": M(
            "raw values to names, or a shared table's name; a pattern (`x01x0111B`) is for reading",
            "{0: line, 1: panel}",
        ),
        "special": M("raw values that are no number; `invalid` means bad quality", "{FFFFH: switched_off}"),
        "range": M(
            "limits for writing, in the unit; an end may be the name of a setting or point",
            "0..max_frequency",
            "what the type can hold",
        ),
        "counts": M("raw counts that may be written at all", "0..3999", "what the type can hold"),
        "rate": M("how often it is read", "fast", "by kind"),
        "access": M("what the register allows", "write", "by kind"),
        "only_when": M("a write or command is refused otherwise", "{running: false}", "always allowed"),
        "wear": M("how many writes it lasts, `unknown`, or `none` where it is not kept", "100000", "`none`"),
        "danger": M("raw value or range to what it does; never without confirmation", "{1110B: initialises}"),
        "step": M("the most that one write may change it, in the unit", "10", "any"),
        "slew": M(
            "rate at which the gateway takes the drive to a new setpoint, in the unit per second",
            "2",
            "at once",
        ),
        "interval": M(
            "least time between two writes; of setpoints the newest waits, other writes are refused",
            "500ms",
            "0ms",
        ),
        "shift": M("setting that is added to the address", "command_shift"),
        "when": M("it is there only then", "{control_mode: vf}", "always"),
        "cases": M(
            "the first one that holds replaces keys of the entry", "[{when: {...}, unit: 0.1 Hz}, ...]"
        ),
        "select": M("written before each access, as one locked sequence", "{array_index: 2}"),
        "then": M("command to run after writes, once a batch", "activate_parameters"),
    },
    "Case": {
        "when": M("the case holds only then", "{frequency_unit: tenth_hz}", "always"),
        "type": M("in place of the entry's", "s16"),
        "words": M("in place of the entry's", "low_first"),
        "unit": M("in place of the entry's; the symbol is the same in all cases", "0.1 Hz"),
        "times": M("in place of the entry's", "e1_04"),
        "offset": M("in place of the entry's", "-40"),
        "values": M("in place of the entry's", "{0: stop, 1: run}"),
        "special": M("in place of the entry's", "{FFFFH: invalid}"),
        "range": M("in place of the entry's", "0..60"),
        "counts": M("in place of the entry's", "0..3999"),
    },
    "Group": {
        "help": M("one sentence for the operator", "Setpoints"),
        "points": M("name to point or register", "{output_frequency: {at: 0024H, unit: 0.01 Hz}}"),
    },
    "Register": {
        "at": M("address of the (first) register", "0024H, Cn-02"),
        "bits": M("name to field: the register is cut up, and its fields are the points", "{running: 0}"),
        "image": M(
            "the core keeps what was commanded last, for a stop and where the word cannot be read", "true"
        ),
        "repeat": M("numbers for `<n>` in the name; the following ones lie next to it", "1..8", "once"),
        "stride": M("distance of the repeats, in registers", "2", "its own width"),
        "help": M("one sentence for the operator", "Frequency at the motor"),
        "silent": M("the drive does not answer a write of it", "true"),
        "twin": M("the point that holds the same value without wear", "frequency_command"),
        "pause": M("silence to keep after a write of it", "5s", "0ms"),
        "sets": M(
            "in `broadcast`: the point of each drive that it changes; in %: a share of its upper limit",
            "frequency_command",
        ),
        "active": M("belongs to a field of `bits`"),
        "always": M("belongs to a field of `bits`"),
        "pulse": M("belongs to a field of `bits`"),
    },
    "BitField": {
        "bit": M("position: `n` or `n..m`, 0 to F", "2..3"),
        "repeat": M("numbers for `<n>` in the name; the following ones lie next to it", "5..8", "once"),
        "stride": M("distance of the repeats, in bits", "2", "its own width"),
        "active": M("which level is true", "low"),
        "always": M("constant in every write; not a point", "1"),
        "pulse": M("written, held this long, then written 0 again", "200ms"),
        "help": M("one sentence for the operator", "The motor is driven"),
    },
    "Command": {
        "help": M("one sentence for the operator", "Run the motor forward"),
        "args": M("argument to the point that lends type, unit and limits", "{frequency: frequency_command}"),
        "only_when": M("refused otherwise", "{run_source: line}", "always allowed"),
        "steps": M(
            "what is done, in this order", "[{write: {run: true}, until: {running: true}, within: 2s}]"
        ),
    },
    "Step": {
        "write": M(
            "point to value, in one transaction; `<argument>` is the caller's, `-<argument>` negated",
            "{run: true, frequency_command: <frequency>}",
        ),
        "until": M("what proves it", "{running: true}", "what was written is read back"),
        "within": M("how long to wait for that", "2s"),
        "when": M("left out unless this holds", "{drive_state: fault}", "always"),
    },
    "Broadcast": {
        "points": M("name to point or register of unit 0", "{frequency_all: {at: 0002H, unit: 1/300 %}}"),
        "commands": M("name to command; `until` is asked of every drive", "{stop_all: {steps: [...]}}"),
    },
    "RawSimulate": {
        "factory": M("address to raw contents at delivery, one or a row of them", "{0101H: [1, 50]}"),
        "units": M("point to the unit that the twin assumes where the document has none", "{p_7: 0.1 s}"),
        "max_frequency": M("highest frequency it takes: Hz, or a point or setting", "60"),
        "base_frequency": M("frequency that the ramp times count to: Hz, or a point or setting", "50"),
        "acceleration": M("ramp time: a time, or a point", "10s"),
        "deceleration": M("ramp time of a stop: a time, or a point", "bn_02"),
        "fast_deceleration": M("ramp time of an emergency stop: a time, or a point", "1s"),
        "run_when": M("run commands of the line are obeyed only then", "{run_source: line}", "always"),
        "frequency_when": M("frequencies of the line are obeyed only then", "{run_source: line}", "always"),
        "panel_frequency": M("point with the frequency that counts otherwise", "preset_frequency_1"),
        "panel_frequency_when": M("it counts only then", "{frequency_source: panel}", "always"),
        "coast_when": M("a stop coasts while this holds", "{stop_mode: coast}", "never"),
        "forward_only_when": M("reverse is forbidden while this holds", "{p_78: 1}", "never"),
        "initialise_when": M("factory contents return when this is written", "{access_level: 14}", "never"),
        "shows": M(
            "point to what it shows: `running`, `output_current`, ..., or other points", "{run_lamp: running}"
        ),
        "codes": M("point to the raw value of each thing it shows", "{fault_code: {fault_overcurrent: 1}}"),
        "history": M("points with the last fault codes, the latest first", "[previous_fault_1]"),
        "alarms": M("fault to its code", "{fault_overcurrent: 10H}"),
        "external_fault": M("a fault that somebody outside demands", "{trips: fault_external, by: input_3}"),
        "reset": M("point that resets faults", "fault_reset"),
        "reset_when": M("what must hold for that", "{running: false}", "always"),
        "actions": M("named value to what the drive does when the line dies", "{coast_to_stop: coast}"),
        "comm_timeout": M("silence after which it takes the line for dead", "2s", "that of `comm_loss`"),
        "locks": M("writes that are refused while something holds", "[{when: {running: true}, what: [sn]}]"),
        "refuses": M("reason given for `read_only` and `locked` writes", "{read_only: locked}"),
        "activates": M("point whose write makes written parameters effective", "enter_ram"),
        "stores": M("point whose write keeps them", "enter_eeprom"),
        "saving": M("how long it is busy then", "500ms"),
        "restarts": M("point to the value whose write restarts the drive", "{reset_word: 9696H}"),
        "restart_time": M("for how long it is gone then", "2s"),
    },
    "RawExternal": {
        "trips": M("the fault that is raised", "fault_external"),
        "by": M("the point that demands it", "external_fault"),
        "action": M("point or setting that tells what the drive does then", "external_fault_action"),
    },
    "RawLock": {
        "when": M("the lock holds then", "{running: true}"),
        "what": M("points and groups", "[sn, cn]", "everything"),
        "reason": M("why the write is refused", "locked"),
    },
}
