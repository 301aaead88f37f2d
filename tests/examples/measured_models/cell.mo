model Cell "a lithium cell: open-circuit voltage and series resistance"
  parameter Real E0(unit="V", min=2.5, max=4.3) = 4.15 "open-circuit voltage";
  parameter Real R0(unit="Ohm", min=0, max=1) = 0.02 "series resistance";
  input Real i(unit="A") "current that is drawn";
  output Real v(unit="V") = E0 - R0*i "voltage at the terminals";
end Cell;
