model CellCharge "a lithium cell whose open-circuit voltage falls with the charge that is drawn"
  parameter Real E0(unit="V", min=2.5, max=4.3) = 4.15 "open-circuit voltage at the begin";
  parameter Real s(unit="V", min=0, max=5) = 0.5 "its fall over the whole charge";
  parameter Real R0(unit="Ohm", min=0, max=1) = 0.02 "series resistance";
  final parameter Real Q(unit="A.s") = 10800 "capacity: 3 A.h";
  input Real i(unit="A") "current that is drawn";
  output Real v(unit="V") = E0 - s*z - R0*i "voltage at the terminals";
  Real z(start=0, fixed=true) "charge that was drawn, of 1";
equation
  Q*der(z) = i;
end CellCharge;
