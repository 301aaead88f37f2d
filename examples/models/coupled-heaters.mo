model CoupledHeaters "two heaters on one board, each with a sensor that lags"
  final parameter Real m(unit="kg") = 0.004 "mass of a heater";
  final parameter Real cp(unit="J/(kg.K)") = 500 "specific heat";
  final parameter Real C(unit="J/K") = m*cp;
  constant Real sigma(unit="W/(m2.K4)") = 5.67e-8 "Stefan-Boltzmann";
  parameter Real g1(unit="W", min=0) = 0.01 "heater 1, per percent";
  parameter Real g2(unit="W", min=0) = 0.01 "heater 2, per percent";
  parameter Real UA(unit="W/K", min=0) = 0.01 "loss of each to the room";
  parameter Real k(unit="W/K", min=0) = 0.01 "from one to the other";
  parameter Real eA(unit="m2", min=0) = 0.001 "radiating area times emissivity";
  parameter Real tau(unit="s", min=0.1, max=200) = 10 "sensors";
  input Real u1(unit="%") "power of heater 1";
  input Real u2(unit="%") "power of heater 2";
  input Real Ta(unit="degC") "room";
  output Real y1(unit="degC") = S1;
  output Real y2(unit="degC") = S2;
  Real T1(unit="degC", start=20) "heater 1";
  Real T2(unit="degC", start=20) "heater 2";
  Real S1(unit="degC", start=20) "sensor 1";
  Real S2(unit="degC", start=20) "sensor 2";
  Real across(unit="W") = k*(T1 - T2) + eA*sigma*((T1 + 273.15)^4 - (T2 + 273.15)^4);
  Real loss1(unit="W") = UA*(T1 - Ta) + eA*sigma*((T1 + 273.15)^4 - (Ta + 273.15)^4);
  Real loss2(unit="W") = UA*(T2 - Ta) + eA*sigma*((T2 + 273.15)^4 - (Ta + 273.15)^4);
equation
  C*der(T1) = g1*u1 - loss1 - across;
  C*der(T2) = g2*u2 - loss2 + across;
  tau*der(S1) = T1 - S1;
  tau*der(S2) = T2 - S2;
end CoupledHeaters;
