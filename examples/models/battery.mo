model Battery "a cell: open-circuit voltage, a series resistance, a pair of resistance and capacity"
  parameter Real E0(unit="V", min=0) = 3.5 "open-circuit voltage, nearly empty";
  parameter Real E1(unit="V", min=0) = 0.5 "its rise to full charge";
  parameter Real E2(unit="V", min=0) = 0.3 "its fall where the cell runs empty";
  parameter Real R0(unit="Ohm", min=0) = 0.03 "series resistance";
  parameter Real R1(unit="Ohm", min=0) = 0.02 "of the pair";
  parameter Real C1(unit="F", min=0) = 1000 "of the pair";
  final parameter Real Q(unit="A.s") = 2.5*3600 "capacity of the cell: 2.5 A h";
  input Real i(unit="A") "current that is drawn";
  output Real v(unit="V") = open - R0*i - v1 "terminals";
  Real z(start=0.95, fixed=true) "charge, of 1";
  Real v1(unit="V", start=0, fixed=true) "of the pair";
  Real open(unit="V") = E0 + E1*z - E2*exp(-20*z);
equation
  Q*der(z) = -i;
  C1*der(v1) = i - v1/R1;
end Battery;
